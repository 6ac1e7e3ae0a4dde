// Two doubles in one register.
#include <stdint.h>

namespace dfm {
namespace {
constexpr uint32_t kWidth = 2;
}
}  // namespace dfm

#include "dense_kernel_lanes.h"

namespace dfm {
namespace {
constexpr DenseKernels kKernels = DEFORM_DENSE_KERNELS("sse2");
}
const DenseKernels &dense_kernels_sse2() { return kKernels; }
}  // namespace dfm
