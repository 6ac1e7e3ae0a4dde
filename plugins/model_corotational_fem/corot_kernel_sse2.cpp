// The baseline of x86-64: four doubles are two registers.
#include "../model_common/lanes_sse2.h"

#include "corot_kernel_cells.h"

namespace corot {
const Kernels *kernels_sse2() { return &kKernels; }
}  // namespace corot
