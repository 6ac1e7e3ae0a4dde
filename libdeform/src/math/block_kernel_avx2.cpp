// Four doubles in one register.
#define DEFORM_WIDTH 4
#include "block_kernel_lanes.h"

const dfm::BlockKernels &dfm::block_kernels_avx2() { return kKernels; }
