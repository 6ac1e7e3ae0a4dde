// Vectors of DEFORM_WIDTH doubles, which the including file defines, for kernels that are compiled for
// several widths. Internal linkage only.
#pragma once
#include <stdint.h>

#define DEFORM_INLINE static inline __attribute__((always_inline))
// Unrolls loops over lanes and registers: the compiler keeps arrays of vectors in registers only if no loop
// is left.
#if defined(__clang__)
#define DEFORM_UNROLL _Pragma("unroll")
#else
#define DEFORM_UNROLL _Pragma("GCC unroll 16")
#endif

namespace dfm {
namespace {

constexpr uint32_t kWidth = DEFORM_WIDTH;

typedef double Vector __attribute__((vector_size(8 * kWidth)));
typedef double Unaligned __attribute__((vector_size(8 * kWidth), aligned(8), may_alias));

DEFORM_INLINE Vector load(const double *p) { return *(const Unaligned *)p; }
DEFORM_INLINE void store(double *p, Vector v) { *(Unaligned *)p = v; }
DEFORM_INLINE Vector splat(double a) { return a - Vector{}; }  // a - 0 is a, whatever its sign

}  // namespace
}  // namespace dfm
