// Four doubles in one register.
#include <stdint.h>

namespace dfm {
namespace {
constexpr uint32_t kWidth = 4;
}
}  // namespace dfm

#include "points_kernel_lanes.h"

namespace dfm {
const PointsKernels &points_kernels_avx2() { return kKernels; }
}  // namespace dfm
