// Two doubles in one register.
#define DEFORM_WIDTH 2
#include "dense_kernel_lanes.h"

const dfm::DenseKernels &dfm::dense_kernels_sse2() { return kKernels; }
