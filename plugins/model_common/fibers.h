// Constants of a cell along an axis, of which a parameter may leave some to those across it.
#pragma once
#include "entry.h"
#include "material.h"

namespace model {

constexpr double kAuto = -1;  // of a constant along the axis: as without an axis
constexpr const char *kNoAxis = "anisotropy_young, anisotropy_poisson and anisotropy_shear are all auto";

// Refuses constants without a positive energy.
inline Fiber fiber_of_cell(const dfm_host *h, const char *who, uint32_t c, double young, double poisson,
                           double young_along, double poisson_along, double shear_along) {
  const auto or_else = [](double x, double otherwise) { return x == kAuto ? otherwise : x; };
  const Transverse t = {young, poisson, or_else(young_along, young), or_else(poisson_along, poisson),
                        or_else(shear_along, lame_of(young, poisson).mu)};
  Fiber out;
  if (fiber_of(t, out)) return out;
  refuse(
      h, who,
      "anisotropy_young %g, anisotropy_poisson %g and anisotropy_shear %g with young %g and poisson %g have "
      "no positive energy in cell %u; raise anisotropy_young or lower anisotropy_poisson",
      t.young_along, t.poisson_along, t.shear_along, young, poisson, c);
}

}  // namespace model
