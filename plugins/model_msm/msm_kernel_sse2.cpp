// The baseline of x86-64: vectors of four as two halves.
#include "msm_kernel_quad.h"

#include <emmintrin.h>

namespace msm {
namespace {
MSM_INLINE void sqrt4(v4 &a) {
  typedef double v2 __attribute__((vector_size(16)));
  const v2 lo = _mm_sqrt_pd(__builtin_shufflevector(a, a, 0, 1)), hi = _mm_sqrt_pd(__builtin_shufflevector(a, a, 2, 3));
  a = __builtin_shufflevector(lo, hi, 0, 1, 2, 3);
}
constexpr Kernels kKernels = {"sse2", load_block, plain_springs, damped_springs, volume_cells};
}  // namespace

const Kernels *kernels_sse2() { return &kKernels; }
}  // namespace msm
