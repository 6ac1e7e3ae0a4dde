// Two doubles in one register.
#define DEFORM_WIDTH 2
#include "block_kernel_lanes.h"

const dfm::BlockKernels &dfm::block_kernels_sse2() { return kKernels; }
