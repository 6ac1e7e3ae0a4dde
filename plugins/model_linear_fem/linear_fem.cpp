// org.deform.linear_fem: linear elasticity on tetrahedra with linear shape functions. The stiffness is
// constant: forces are those of small displacements, and a body that turns resists
// (doc/models/linear_fem.md).
#include <cstring>

#include "linear_body.h"

namespace linear {

namespace {
using AnyBody = model::ByKind<Body>;
using Ops = model::Ops<AnyBody>;
constexpr uint32_t kEach = DFM_PARAM_RUNTIME | DFM_PARAM_PER_CELL;
}
const dfm_param kParams[kParamCount] = {
    {"young", "Young's modulus", "Pa", 1e-3, 1e13, 1e5, kEach | DFM_PARAM_LOG_SCALE, 1, nullptr},
    {"poisson", "Poisson's ratio", "1", -0.99, 0.4999, 0.3, kEach, 1, nullptr},
    {"damping_stiffness", "Rayleigh damping: damping over stiffness", "s", 0, 1e3, 0, kEach, 1, nullptr},
    {"damping_mass", "Rayleigh damping: drag over mass", "1/s", 0, 1e6, 0, kEach, 1, nullptr},
};

namespace {

using Entry = model::InRange<AnyBody, kId, kParams>;

const dfm_effect_row kOff[] = {{"damping", kDampingStiffness, 0, 0}, {"damping", kDampingMass, 0, 0}};
const dfm_effect_rows kEffectRows = model::rows_of(kOff);

const void *extension(const void *, const char *id) {
  if (!strcmp(id, DFM_EXT_CELL_ENERGY)) return &Ops::kCellEnergy;
  if (!strcmp(id, DFM_EXT_CELL_STRESS)) return &Ops::kCellStress;
  if (!strcmp(id, DFM_EXT_EFFECTS)) return &Ops::kActiveEffects;
  if (!strcmp(id, DFM_EXT_EFFECT_ROWS)) return &kEffectRows;
  return nullptr;
}

const char *const kEffects[] = {"damping", nullptr};

const dfm_model kModel = model::table<AnyBody>(
    DFM_CAP_ENERGY | DFM_CAP_STIFFNESS | DFM_CAP_DAMPING | DFM_CAP_CONSTANT_STIFFNESS | DFM_CAP_INSIDE,
    Entry::create, Entry::set_params, nullptr, extension);

const dfm_type kType =
    dfm::plugin::type(DFM_KIND_MODEL, kId, "linear elasticity", "0.1.0", "MIT",
                      "finite elements of linear elasticity (Zienkiewicz, Taylor, Zhu 2013, The Finite "
                      "Element Method: Its Basis and Fundamentals, ch. 2)",
                      kParams, kEffects, &kModel);

}  // namespace
}  // namespace linear

DFM_PLUGIN(&linear::kType)
