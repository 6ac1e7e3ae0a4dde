// Eight contacts at a time, for every law of the shelf: the lanes, the values that they are kept within, and the choice of vector width.
//
// The passes over a block choose by value, not by branch: real batches mix stick and slip, and a mispredicted branch costs more than both
// sides. They run the same operations in the same order at every width, without fused multiply-add, so the wide build of a law gives the bits
// of the narrow one.
#pragma once
#include <cmath>
#include <cstdio>

#include "deform/plugin.hpp"

namespace lanes {

constexpr uint32_t kLanes = 8;

#if defined(__x86_64__) && defined(__GNUC__)
#define DEFORM_WIDE __attribute__((target("avx2"), flatten))
#define DEFORM_NARROW __attribute__((flatten))
inline bool wide() { return __builtin_cpu_supports("avx2"); }
#else
#define DEFORM_WIDE
#define DEFORM_NARROW
inline bool wide() { return false; }
#endif

// Law::run(in, out) compiled twice; the processor chooses. Everything it calls is drawn into the two bodies.
template <class Law>
DEFORM_WIDE dfm_status eval_wide(const dfm_friction_in *in, dfm_friction_out *out) { return Law::run(in, out); }
template <class Law>
DEFORM_NARROW dfm_status eval_narrow(const dfm_friction_in *in, dfm_friction_out *out) { return Law::run(in, out); }
template <class Law>
dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) { return wide() ? eval_wide<Law>(in, out) : eval_narrow<Law>(in, out); }

// A NaN becomes `most`: what a lane computes stays finite, and its outputs are spoilt at the end by what came in.
inline double within(double x, double most) {
  const double low = x > -most ? x : -most;
  return low < most ? low : most;
}

}  // namespace lanes
