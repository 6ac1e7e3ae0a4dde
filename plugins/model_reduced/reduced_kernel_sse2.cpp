#include <stddef.h>

namespace reduced {
namespace {
constexpr size_t kWidth = 2;  // doubles in a register
}  // namespace
}  // namespace reduced

#include "reduced_kernel_lanes.h"

namespace reduced {
const Kernels *kernels_sse2() { return &kKernels; }
}  // namespace reduced
