// Four doubles in one register, twice as many registers.
#include "../model_common/lanes_avx.h"

#include "corot_kernel_cells.h"

namespace corot {
const Kernels *kernels_avx512() { return &kKernels; }
}  // namespace corot
