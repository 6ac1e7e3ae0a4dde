#include "reduced_kernel_lanes.h"

namespace reduced {
const Kernels *kernels_avx2() { return &kKernels; }
}  // namespace reduced
