#include <stddef.h>

namespace reduced {
namespace {
constexpr size_t kWidth = 4;  // doubles in a register
}  // namespace
}  // namespace reduced

#include "reduced_kernel_lanes.h"

namespace reduced {
const Kernels *kernels_avx2() { return &kKernels; }
}  // namespace reduced
