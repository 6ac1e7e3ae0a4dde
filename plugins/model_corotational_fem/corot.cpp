// org.deform.corotational_fem: linear tetrahedra whose strain is measured in a frame that rotates with each
// cell. Zerbato 2010, 2.1.2, (2.1)-(2.13), as corrected in doc/models/corotational_fem.md, which derives
// the equations used here.
#include <string.h>

#include "corot_body.h"
#include "deform/plugin_draft.h"

namespace corot {

namespace {
using AnyBody = model::ByKind<Body>;
using Ops = model::Ops<AnyBody>;
constexpr uint32_t kRun = DFM_PARAM_RUNTIME, kCell = DFM_PARAM_PER_CELL, kUnlessGiven = DFM_PARAM_AUTO;
const char *const kEnergies[] = {"corotational", "neo_hookean", "stvk", nullptr};
const char *const kTangents[] = {"usual", "exact", nullptr};
const char *const kLockings[] = {"none", "nodal", nullptr};
const char *const kRotations[] = {"polar", "svd", "qr", nullptr};
}  // namespace

const dfm_param kParams[kParamCount] = {
    {"young", "Young's modulus", "Pa", 1e-3, 1e13, 1e5, kRun | DFM_PARAM_LOG_SCALE | kCell, 1, nullptr},
    {"poisson", "Poisson ratio", "1", -0.99, 0.4999, 0.3, kRun | kCell, 1, nullptr},
    {"damping_stiffness", "damping over stiffness of each cell", "s", 0, 1e3, 0, kRun | kCell, 1, nullptr},
    {"damping_mass", "drag over mass of each point", "1/s", 0, 1e6, 0, kRun | kCell, 1, nullptr},
    {"energy", "corotational: linear in the frame; or an energy of the gradient", "1", 0, 2, kLinear,
     kRun | DFM_PARAM_ENUM, 1, kEnergies},
    {"rotation", "how the frame of a cell is found; qr depends on the axes of the rest shape", "1", 0, 2,
     kPolar, kRun | DFM_PARAM_ENUM, 1, kRotations},
    {"tangent", "stiffness for implicit steps; exact: with the turning of the frames", "1", 0, 1, kUsual,
     kRun | DFM_PARAM_ENUM, 1, kTangents},
    {"locking", "remedy near poisson 1/2; nodal: the volume change is averaged around each point", "1", 0, 1,
     kLocked, DFM_PARAM_ENUM, 1, kLockings},
    {"yield", "von Mises stress at which the cells flow; 0: elastic", "Pa", 0, 1e13, 0, kRun | kCell, 1,
     nullptr},
    {"hardening", "growth of the yield stress over the equivalent plastic strain", "Pa", 0, 1e13, 0,
     kRun | kCell, 1, nullptr},
    {"creep", "one over the time in which the stress beyond yield relaxes; auto, -1: at once", "1/s", kAuto,
     1e12, kAuto, kRun | kUnlessGiven, 1, nullptr},
    {"plastic_limit", "accumulated equivalent plastic strain at which the flow ends; 0: none", "1", 0, 1e6, 0,
     kRun | kCell, 1, nullptr},
    {"collapse", "pressure of a cell without volume against collapse, over young; 0: none", "1", 0, 1e3, 0,
     kRun, 1, nullptr},
    {"anisotropy_young", "Young's modulus along the axis; auto, -1: young", "Pa", kAuto, 1e13, kAuto,
     kRun | kCell | kUnlessGiven, 1, nullptr},
    {"anisotropy_poisson",
     "contraction across the axis over the strain of a pull along it; auto, -1: poisson", "1", kAuto, 10,
     kAuto, kRun | kCell | kUnlessGiven, 1, nullptr},
    {"anisotropy_shear", "shear modulus along the axis; auto, -1: that of young and poisson", "Pa", kAuto,
     1e13, kAuto, kRun | kCell | kUnlessGiven, 1, nullptr},
    {"anisotropy_axis", "axis of the anisotropy; its length does not matter", "1", -1e6, 1e6, 1, kRun | kCell,
     3, nullptr},
};

void complain(const dfm_host *h, const char *what) { model::complain(h, kId, what); }

namespace {

bool check_params(const dfm_host *h, const double *values) {
  if (!model::in_range(h, kId, kParams, kParamCount, values)) return false;
  if (values[kCreep] < 0 && values[kCreep] != kAuto) {
    complain(h, "parameter creep is between -1 and 0; give -1 (at once), 0 (no flow) or a positive rate");
    return false;
  }
  if (model::has_direction(values + kAxis)) return true;
  complain(h, "parameter anisotropy_axis is zero; give a direction");
  return false;
}

dfm_status create(const dfm_host *h, const dfm_mesh *m, void **self) {
  *self = nullptr;
  return check_params(h, m->params) ? model::create<AnyBody>(h, m, kId, self) : DFM_E_ARG;
}

dfm_status set_params(void *self, const double *params) {
  AnyBody *any = static_cast<AnyBody *>(self);
  if (!check_params(any->host, params)) return DFM_E_ARG;
  if (params[kLocking] != any->tet.params[kLocking] && !any->by_cells) {
    complain(any->host, "parameter locking cannot change during a run; create the body again");
    return DFM_E_ARG;
  }
  return model::change(*any, params);
}

dfm_status state_init(const void *self, double *state) {
  std::fill_n(state, static_cast<const AnyBody *>(self)->with([](auto &b) { return b.state_size(); }), 0.0);
  return DFM_OK;
}

// The plastic strain at the points of a cell, of which a first-order tetrahedron has one.
constexpr dfm_slot slot_of(uint32_t points) {
  return {DFM_PER_CELL, points * model::plastic::kState, DFM_SLOT_SCALAR, 0};
}
const dfm_slot kPoint = slot_of(1), kEight = slot_of(8), kMany = slot_of(27);
const dfm_slots kNoSlots = {sizeof(dfm_slots), 0, nullptr, 0, 0},
                kSlots = {sizeof(dfm_slots), 1, &kPoint, 0, 0},
                kSlotsOfEight = {sizeof(dfm_slots), 1, &kEight, 0, 0},
                kSlotsOfMany = {sizeof(dfm_slots), 1, &kMany, 0, 0};

constexpr uint32_t kCaps =
    DFM_CAP_ENERGY | DFM_CAP_STIFFNESS | DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT | DFM_CAP_INSIDE;

// The energy is not stationary in a frame by Gram-Schmidt, so forces are no gradient and have a moment.
// Energies of the gradient need no frame.
uint32_t caps_of(const void *self) {
  const auto &params = static_cast<const AnyBody *>(self)->tet.params;
  const bool gradient = uint32_t(params[kRotation]) != kQr || uint32_t(params[kEnergy]) != kLinear;
  return gradient ? kCaps : kCaps & ~uint32_t(DFM_CAP_ENERGY | DFM_CAP_ROTATION_INVARIANT);
}

const dfm_topology kTopology = {sizeof(dfm_topology), 0, nullptr};
const dfm_caps kOwnCaps = {sizeof(dfm_caps), 0, caps_of};

const dfm_effect_row kOff[] = {{"damping", kDampingStiffness, 0, 0},  {"damping", kDampingMass, 0, 0},
                               {"anisotropy", kYoungAlong, 0, kAuto}, {"anisotropy", kPoissonAlong, 0, kAuto},
                               {"anisotropy", kShearAlong, 0, kAuto}, {"deform.plasticity", kYield, 0, 0}};
const dfm_effect_rows kEffectRows = model::rows_of(kOff);

const void *extension(const void *self, const char *id) {
  if (!strcmp(id, DFM_EXT_CAPS)) return &kOwnCaps;
  if (!strcmp(id, DFM_EXT_CELL_ENERGY)) return &Ops::kCellEnergy;
  if (!strcmp(id, DFM_EXT_CELL_STRESS)) return &Ops::kCellStress;
  if (!strcmp(id, DFM_EXT_SLOTS)) {
    const AnyBody &body = *static_cast<const AnyBody *>(self);
    return body.with([](auto &b) { return !b.plastic(); }) ? &kNoSlots
           : !body.by_cells                                ? &kSlots
           : body.cells.points() == 8                      ? &kSlotsOfEight
                                                           : &kSlotsOfMany;
  }
  if (!strcmp(id, DFM_EXT_EFFECTS)) return &Ops::kActiveEffects;
  if (!strcmp(id, DFM_EXT_EFFECT_ROWS)) return &kEffectRows;
  if (!strcmp(id, DFM_EXT_IDLE)) return &Ops::kIdle;
  if (!strcmp(id, DFM_EXT_TOPOLOGY)) return &kTopology;
  return nullptr;
}

const char *const kEffects[] = {"volume",     "damping",           "large_rotation",
                                "anisotropy", "deform.plasticity", nullptr};

const dfm_model kModel = model::table<AnyBody>(kCaps, create, set_params, state_init, extension);

const dfm_type kType =
    dfm::plugin::type(DFM_KIND_MODEL, kId, "corotational finite elements", "0.1.0", "MIT",
                      "Zerbato 2010, (2.1)-(2.13) corrected; Mueller and Gross 2004, Interactive virtual "
                      "materials; Horn 1987 for the rotation",
                      kParams, kEffects, &kModel);

}  // namespace
}  // namespace corot

DFM_PLUGIN(&corot::kType)
