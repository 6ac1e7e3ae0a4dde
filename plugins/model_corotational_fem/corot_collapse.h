// The pressure against collapse of a cell: with u = 1 - J/kFlat above zero, K the parameter `collapse`,
//   W = K E kFlat u^4/4,   -dW/dJ = K E u^3,   d2W/dJ2 = 3 K E/kFlat u^2
// up to u = 1 (J = 0), where the cell turns inside out; beyond, the stiffness is constant, so that the step
// bound stays finite. For vectors of lanes and for double alike.
#pragma once
#include "corot_kernel.h"

namespace corot {
namespace {

// Times the volume of the cell.
template <class Ops>
struct Collapse {
  typename Ops::V pressure, stiffness, energy;
};

// E V of a cell without fibers, of 2 mu V and lambda V.
template <class Ops>
static inline __attribute__((always_inline)) typename Ops::V young_of(typename Ops::V mu2,
                                                                      typename Ops::V lambda) {
  const typename Ops::V half = Ops::splat(0.5), sum = lambda + half * mu2 + Ops::splat(1e-300);
  return half * (mu2 * (Ops::splat(3) * lambda + mu2)) / sum;
}

// det: J. young: E V.
template <class Ops>
static inline __attribute__((always_inline)) Collapse<Ops> collapse_of(double collapse, typename Ops::V det,
                                                                       typename Ops::V young) {
  using V = typename Ops::V;
  const V zero = Ops::splat(0), one = Ops::splat(1);
  const V c = Ops::splat(collapse) * young;
  const V u = Ops::more(one - Ops::splat(1 / kFlat) * det, zero), in = Ops::less(u, one), out = u - in;
  const V square = in * in;
  const V way = Ops::splat(0.25) * (square * square) + (out + Ops::splat(1.5) * (out * out));
  return {c * (square * in + Ops::splat(3) * out), c * (Ops::splat(3 / kFlat) * square),
          c * (Ops::splat(kFlat) * way)};
}

}  // namespace
}  // namespace corot
