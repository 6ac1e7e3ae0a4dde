// Four doubles in one register.
#include "../model_common/lanes_avx.h"

#include "corot_kernel_cells.h"

namespace corot {
const Kernels *kernels_avx2() { return &kKernels; }
}  // namespace corot
