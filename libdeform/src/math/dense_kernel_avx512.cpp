// Eight doubles in one register.
#include <stdint.h>

namespace dfm {
namespace {
constexpr uint32_t kWidth = 8;
}
}  // namespace dfm

#include "dense_kernel_lanes.h"

namespace dfm {
namespace {
constexpr DenseKernels kKernels = DEFORM_DENSE_KERNELS("avx512");
}
const DenseKernels &dense_kernels_avx512() { return kKernels; }
}  // namespace dfm
