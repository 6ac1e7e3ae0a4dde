#include "reduced_kernel_lanes.h"

namespace reduced {
const Kernels *kernels_avx512() { return &kKernels; }
}  // namespace reduced
