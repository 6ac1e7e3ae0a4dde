// org.deform.meshless: elasticity on scattered points. Gradients by moving least squares of first order
// (Mueller, Keiser, Nealen, Pauly, Gross, Alexa 2004; Zerbato 2010, (2.28)-(2.44), corrected), forces the
// exact gradient of the energy, residuals of the fit held by an energy of their own
// (doc/models/meshless.md).
#include <cstring>

#include "meshless_body.h"

namespace meshless {

namespace {
using Ops = model::Ops<Body>;
constexpr uint32_t kRun = DFM_PARAM_RUNTIME, kEach = kRun | DFM_PARAM_PER_CELL;
const char *const kStrains[] = {"corotational", "green", nullptr};
const char *const kVolumeKinds[] = {"cells", "masses", nullptr};
}  // namespace

const dfm_param kParams[kParamCount] = {
    {"young", "Young's modulus", "Pa", 1e-3, 1e13, 1e5, kEach | DFM_PARAM_LOG_SCALE, 1, nullptr},
    {"poisson", "Poisson's ratio", "1", -0.99, 0.4999, 0.3, kEach, 1, nullptr},
    {"damping_stiffness", "Rayleigh damping: damping over stiffness", "s", 0, 1e3, 0, kEach, 1, nullptr},
    {"damping_mass", "Rayleigh damping: drag over mass", "1/s", 0, 1e6, 0, kEach, 1, nullptr},
    {"hourglass", "stiffness against what gradients do not see, over 2 mu", "1", 0, 100, 0.1, kRun, 1,
     nullptr},
    {"support", "radius of the neighborhood, in mean distances of the ten nearest points", "1", 1.2, 4, 1.5,
     0, 1, nullptr},
    {"strain", "energy of the gradient: corotated strain, or Green's", "1", 0, 1, kCorotational,
     DFM_PARAM_ENUM, 1, kStrains},
    {"volumes", "of the points: a quarter of their cells', or the body's by mass", "1", 0, 1, kCells,
     DFM_PARAM_ENUM, 1, kVolumeKinds},
};

namespace {

using Entry = model::InRange<Body, kId, kParams>;

const dfm_effect_row kOff[] = {{"damping", kDampingStiffness, 0, 0}, {"damping", kDampingMass, 0, 0}};
const dfm_effect_rows kEffectRows = model::rows_of(kOff);

const void *extension(const void *, const char *id) {
  if (!strcmp(id, DFM_EXT_CELL_ENERGY)) return &Ops::kCellEnergy;
  if (!strcmp(id, DFM_EXT_EFFECTS)) return &Ops::kActiveEffects;
  if (!strcmp(id, DFM_EXT_EFFECT_ROWS)) return &kEffectRows;
  return nullptr;
}

const char *const kEffects[] = {"large_rotation", "damping", nullptr};

const dfm_model kModel =
    model::table<Body>(DFM_CAP_ENERGY | DFM_CAP_STIFFNESS | DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT,
                       Entry::create, Entry::set_params, nullptr, extension);

const dfm_type kType =
    dfm::plugin::type(DFM_KIND_MODEL, kId, "meshless elasticity", "0.1.0", "MIT",
                      "Mueller et al. 2004, Point based animation of elastic, plastic and melting objects; "
                      "Zerbato 2010, (2.28)-(2.44) corrected; Ganzenmueller 2015 for the residuals",
                      kParams, kEffects, &kModel);

}  // namespace
}  // namespace meshless

DFM_PLUGIN(&meshless::kType)
