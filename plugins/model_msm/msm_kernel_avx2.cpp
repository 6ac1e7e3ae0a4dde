// Vectors of four in one register.
#include "msm_kernel_quad.h"

#include <immintrin.h>

namespace msm {
namespace {
MSM_INLINE void sqrt4(v4 &a) { a = _mm256_sqrt_pd(a); }
constexpr Kernels kKernels = {"avx2", load_block, plain_springs, damped_springs, volume_cells};
}  // namespace

const Kernels *kernels_avx2() { return &kKernels; }
}  // namespace msm
