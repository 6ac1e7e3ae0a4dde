#include "model_common/lanes_avx.h"

namespace lanes {
namespace {
DEFORM_INLINE v4 gather4(const double *p, const unsigned *n) {
  return _mm256_i32gather_pd(p, _mm_loadu_si128(reinterpret_cast<const __m128i *>(n)), 8);
}
}  // namespace
}  // namespace lanes

#include "msm_bound_lanes.h"

namespace bound {
const Kernels *kernels_avx2() { return &kKernels; }
}  // namespace bound
