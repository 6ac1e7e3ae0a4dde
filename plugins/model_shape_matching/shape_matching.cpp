// org.deform.shape_matching: points are drawn to goals, the rest shape fitted to where they are (Mueller,
// Heidelberger, Teschner, Gross 2005). It steps itself and is plausible, not physical: no constant of it is
// one of a material (doc/models/shape_matching.md).
#include <cstring>

#include "shape_body.h"

namespace shape {

namespace {
using Ops = model::StepperOps<Body>;
constexpr uint32_t kRun = DFM_PARAM_RUNTIME;
const char *const kModes[] = {"rigid", "linear", "quadratic", nullptr};
}  // namespace

const dfm_param kParams[kParamCount] = {
    {"mode", "what goals may be of the rest shape: turned, also stretched and sheared, also bent and twisted",
     "1", 0, 2, kLinear, DFM_PARAM_ENUM, 1, kModes},
    {"stiffness", "a0: share of a deviation from the goal that is gone after reference_step", "1", 1e-6,
     0.999999, 0.9999, kRun, 1, nullptr},
    {"reference_step", "h0, the time that stiffness is meant for", "s", 1e-6, 1e3, 0.01,
     kRun | DFM_PARAM_LOG_SCALE, 1, nullptr},
    {"damping_ratio", "of the motion about the goals, over the critical one", "1", 0, 1, 0.5, kRun, 1,
     nullptr},
    {"linearity", "how far goals follow the fit of their mode; 0: goals are rigid", "1", 0, 0.99, 0.5, kRun,
     1, nullptr},
    {"clusters", "pieces with goals of their own", "1", 1, 4096, 1, DFM_PARAM_INTEGER, 1, nullptr},
    {"overlap", "how far clusters reach into each other, over their radius", "1", 0, 4, 0.5, 0, 1, nullptr},
    {"plastic_creep", "rate of plastic flow; 0: elastic", "1/s", 0, 1e6, 0, kRun, 1, nullptr},
    {"plastic_yield", "strain above which the rest shape flows", "1", 0, 10, 0.05, kRun, 1, nullptr},
    {"plastic_max", "largest plastic strain", "1", 0, 0.9, 0.5, kRun, 1, nullptr},
    {"damping_mass", "drag over mass of each point", "1/s", 0, 1e6, 0, kRun, 1, nullptr},
};

namespace {

using Entry = model::InRange<Body, kId, kParams>;

dfm_status state_init(const void *self, double *state) {
  static_cast<const Body *>(self)->init_state(state);
  return DFM_OK;
}

const dfm_effect_row kOff[] = {
    {"damping", kDamping, 0, 0}, {"damping", kDampingMass, 0, 0}, {"plasticity", kCreep, 0, 0}};
const dfm_effect_rows kEffectRows = model::rows_of(kOff);

const void *extension(const void *self, const char *id) {
  if (!strcmp(id, "dfm.stepper/1")) return &Ops::kStepper;
  if (!strcmp(id, DFM_EXT_SLOTS)) return &static_cast<const Body *>(self)->slots;
  if (!strcmp(id, DFM_EXT_EFFECTS)) return &Ops::kActiveEffects;
  if (!strcmp(id, DFM_EXT_EFFECT_ROWS)) return &kEffectRows;
  if (!strcmp(id, DFM_EXT_IDLE)) return &Ops::kIdle;
  return nullptr;
}

const char *const kEffects[] = {"large_rotation", "damping", "plasticity", nullptr};

const dfm_model kModel =
    model::bare_table<Body>(DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT | DFM_CAP_PLAUSIBLE, Entry::create,
                            Entry::set_params, state_init, extension);

const dfm_type kType =
    dfm::plugin::type(DFM_KIND_MODEL, kId, "shape matching (plausible)", "0.1.0", "MIT",
                      "Mueller, Heidelberger, Teschner, Gross 2005, Meshless deformations based on shape "
                      "matching, (7), (9)-(14); Zerbato 2010, (2.45)-(2.47) corrected",
                      kParams, kEffects, &kModel);

}  // namespace
}  // namespace shape

DFM_PLUGIN(&shape::kType)
