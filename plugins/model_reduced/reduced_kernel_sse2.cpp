#include "reduced_kernel_lanes.h"

namespace reduced {
const Kernels *kernels_sse2() { return &kKernels; }
}  // namespace reduced
