// Eight contacts at a time, for every law of the library: lanes, ranges of values, and the choice of vector
// width.
//
// The passes over a block select values instead of branching: real batches mix stick and slip, and a
// mispredicted branch costs more than computing both sides. They run the same operations in the same order at
// every width, without fused multiply-add, so every width gives the same bits.
#pragma once
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#define DFM_ELEMENTARY_ALWAYS_INLINE  // a law's passes are compiled for several widths
#include "deform/plugin.hpp"

namespace lanes {

constexpr uint32_t kLanes = 8;

// A pass over a block. Columns do not overlap, so lanes are independent; the compiler cannot detect that and
// needs a pragma.
#ifdef __clang__
// a build without optimization does not vectorize, which is no error
#pragma clang diagnostic ignored "-Wpass-failed"
#define EACH_LANE(i)                                                                                         \
  _Pragma("clang loop vectorize(assume_safety) interleave(disable) unroll(disable)") for (uint32_t i = 0;    \
                                                                                          i < lanes::kLanes; \
                                                                                          ++i)
#elif defined(__GNUC__)
#define EACH_LANE(i) _Pragma("GCC ivdep") for (uint32_t i = 0; i < lanes::kLanes; ++i)
#else
#define EACH_LANE(i) for (uint32_t i = 0; i < lanes::kLanes; ++i)
#endif

enum Width { kNarrow, kAvx2, kAvx512 };

#if defined(__x86_64__) && defined(__GNUC__)
#define DEFORM_PASS __attribute__((always_inline))
#ifdef __clang__
#define DEFORM_AVX512 __attribute__((target("avx512f,avx512vl,avx512dq"), flatten))
#else
#define DEFORM_AVX512 __attribute__((target("avx512f,avx512vl,avx512dq,prefer-vector-width=512"), flatten))
#endif
#define DEFORM_AVX2 __attribute__((target("avx2"), flatten))
#define DEFORM_NARROW __attribute__((flatten))
inline Width widest() {
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq"))
    return kAvx512;
  return __builtin_cpu_supports("avx2") ? kAvx2 : kNarrow;
}
#else
#define DEFORM_PASS
#define DEFORM_AVX512
#define DEFORM_AVX2
#define DEFORM_NARROW
inline Width widest() { return kNarrow; }
#endif

// Law::run(in, out) compiled once per width, selected at run time. Functions that it calls must be inlined,
// otherwise they would have the baseline width: gcc inlines everything that a `flatten` function calls, clang
// only the outermost calls, so each pass is marked DEFORM_PASS.
template <class Law>
DEFORM_AVX512 dfm_status eval_avx512(const dfm_friction_in *in, dfm_friction_out *out) {
  return Law::run(in, out);
}
template <class Law>
DEFORM_AVX2 dfm_status eval_avx2(const dfm_friction_in *in, dfm_friction_out *out) {
  return Law::run(in, out);
}
template <class Law>
DEFORM_NARROW dfm_status eval_narrow(const dfm_friction_in *in, dfm_friction_out *out) {
  return Law::run(in, out);
}

// DEFORM_SIMD (sse2, avx2, avx512) limits the width; read when the plugin is loaded.
inline Width chosen() {
  const char *const requested = std::getenv("DEFORM_SIMD");
  const Width most = widest();
  const Width w = !requested                        ? most
                  : !std::strcmp(requested, "sse2") ? kNarrow
                  : !std::strcmp(requested, "avx2") ? kAvx2
                                                    : most;
  return w < most ? w : most;
}
inline const Width kChosen = chosen();

template <class Law>
dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  return kChosen == kAvx512 ? eval_avx512<Law>(in, out)
         : kChosen == kAvx2 ? eval_avx2<Law>(in, out)
                            : eval_narrow<Law>(in, out);
}

// A NaN becomes `most`: intermediate values stay finite, and the outputs are set to NaN at the end.
DEFORM_PASS inline double within(double x, double most) {
  const double low = x > -most ? x : -most;
  return low < most ? low : most;
}

}  // namespace lanes
