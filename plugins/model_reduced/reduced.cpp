// org.deform.modal, org.deform.condensed, org.deform.boundary: linear elasticity by few modes in a floating
// frame, and what they leave out at rest; the bodies step themselves (doc/models/modal.md, condensed.md,
// boundary.md).
#include <cstring>

#include "../model_common/stepper.h"
#include "body.h"

namespace reduced {

namespace {
constexpr uint32_t kElastic = DFM_PARAM_PER_CELL;
}
const dfm_param kParams[kParamCount] = {
    {"young", "Young's modulus", "Pa", 1e-3, 1e13, 1e5, kElastic | DFM_PARAM_LOG_SCALE, 1, nullptr},
    {"poisson", "Poisson's ratio", "1", -0.99, 0.4999, 0.3, kElastic, 1, nullptr},
    {"damping_stiffness", "Rayleigh damping: damping over stiffness", "s", 0, 1e3, 0, DFM_PARAM_RUNTIME, 1,
     nullptr},
    {"damping_mass", "Rayleigh damping: drag over mass", "1/s", 0, 1e6, 0, DFM_PARAM_RUNTIME, 1, nullptr},
    {"modes", "number of modes; 0, auto: by frequency or share, else 40", "1", 0, kMaxModes, 0,
     DFM_PARAM_INTEGER | DFM_PARAM_AUTO, 1, nullptr},
    {"frequency", "all modes up to this frequency; 0: not asked", "Hz", 0, 1e9, 0, 0, 1, nullptr},
    {"share", "modes that hold this share of the static response at the surface; 0: not asked", "1", 0, 0.999,
     0, 0, 1, nullptr},
};

namespace {

// Ops and extensions of a type whose instances are of the class B.
template <class B>
struct Entry {
  using Ops = model::StepperOps<B>;

  static dfm_status create(const dfm_host *h, const dfm_mesh *m, void **self) {
    return model::create<B>(h, m, B().name(), self);
  }
  static dfm_status set_params(void *self, const double *params) {
    return model::change_in_range<B>(self, static_cast<B *>(self)->name(), kParams, params);
  }
  static dfm_status state_init(const void *, double *state) {
    *state = 0;
    return DFM_OK;
  }
  static dfm_status commit_near(void *self, const dfm_kin *k, const double *p, double *x, double *v) {
    return Ops::with_state(self, k, [&](B &body) { body.commit_near(*k, p, x, v); });
  }
  static dfm_status points(void *self, const dfm_kin *k, double *x, double *v) {
    return Ops::with_state(self, k, [&](B &body) { body.points(*k, x, v); });
  }
  static dfm_status look(const void *, double *state) {
    B::look(state);
    return DFM_OK;
  }
  static dfm_status sums(void *self, const dfm_kin *k, double *out) {
    bool known = false;
    const dfm_status given = Ops::with_state(self, k, [&](B &body) { known = body.sums(*k, out); });
    return given != DFM_OK || known ? given : DFM_DISCARD;
  }
  static constexpr dfm_late_points kLate = {sizeof(dfm_late_points), 0, commit_near, points, look, sums};

  static constexpr dfm_effect_row kOff[] = {{"damping", kDampingStiffness, 0, 0},
                                            {"damping", kDampingMass, 0, 0}};
  static constexpr dfm_effect_rows kEffectRows = model::rows_of(kOff);
  static const void *extension(const void *self, const char *id) {
    const B &body = *static_cast<const B *>(self);
    if (!strcmp(id, "dfm.stepper/1")) return &Ops::kStepper;
    if (!strcmp(id, DFM_EXT_LATE_POINTS)) return body.can_be_late() ? &kLate : nullptr;
    if (!strcmp(id, DFM_EXT_SLOTS)) return body.slots();
    if (!strcmp(id, DFM_EXT_CELL_ENERGY)) return &Ops::kCellEnergy;
    if (!strcmp(id, DFM_EXT_CELL_STRESS)) return &Ops::kCellStress;
    if (!strcmp(id, DFM_EXT_EFFECTS)) return &Ops::kActiveEffects;
    if (!strcmp(id, DFM_EXT_EFFECT_ROWS)) return &kEffectRows;
    if (!strcmp(id, DFM_EXT_FACTS)) return &Ops::kFacts;
    if (!strcmp(id, DFM_EXT_IDLE)) return &Ops::kIdle;
    return nullptr;
  }

  // Was the body touched in the last step? Everything else follows from the points, but where they may be
  // late: Body::slots.
  static constexpr dfm_slot kSlots[] = {{DFM_PER_INSTANCE, 1, DFM_SLOT_SCALAR, 0}};

  static constexpr dfm_model kModel = [] {
    dfm_model t = model::bare_table<B>(DFM_CAP_ENERGY | DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT |
                                           (model::cells_of<B>() == DFM_CELL_TET ? 0 : DFM_CAP_INSIDE),
                                       create, set_params, state_init, extension);
    t.nslot = 1;
    t.slots = kSlots;
    t.energy = Ops::energy;
    return t;
  }();
};

const char *const kEffects[] = {"large_rotation", "damping", nullptr};

const dfm_type kModal =
    dfm::plugin::type(DFM_KIND_MODEL, kModalId, "modes of linear elasticity", "0.1.0", "MIT",
                      "modes of finite elements (Pentland, Williams 1989, Good Vibrations, SIGGRAPH) "
                      "in a floating frame (Shabana 2020, Dynamics of Multibody Systems, ch. 5)",
                      kParams, kEffects, &Entry<Modal>::kModel);

const dfm_type kCondensed = dfm::plugin::type(
    DFM_KIND_MODEL, kCondensedId, "linear elasticity condensed to the surface", "0.1.0", "MIT",
    "static condensation (Guyan 1965, AIAA Journal 3) with modes for the inertia and a "
    "residual flexibility (MacNeal 1971, Computers & Structures 1)",
    kParams, kEffects, &Entry<Condensed>::kModel);

const dfm_type kBoundary = dfm::plugin::type(
    DFM_KIND_MODEL, kBoundaryId, "linear elasticity by boundary elements", "0.1.0", "MIT",
    "symmetric Galerkin boundary elements (Sirtori 1979, Meccanica 14; Han 1994, Computing 52) in place of "
    "condensed cells",
    kParams, kEffects, &Entry<Surface>::kModel);

}  // namespace
}  // namespace reduced

DFM_PLUGIN(&reduced::kModal, &reduced::kCondensed, &reduced::kBoundary)
