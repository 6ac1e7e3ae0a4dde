#include "model_common/lanes_sse2.h"

namespace lanes {
namespace {
DEFORM_INLINE v4 gather4(const double *p, const unsigned *n) {
  return {_mm_set_pd(p[n[1]], p[n[0]]), _mm_set_pd(p[n[3]], p[n[2]])};
}
}  // namespace
}  // namespace lanes

#include "msm_bound_lanes.h"

namespace bound {
const Kernels *kernels_sse2() { return &kKernels; }
}  // namespace bound
