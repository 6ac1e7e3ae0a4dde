// Four doubles in one register.
#define DEFORM_WIDTH 4
#include "dense_kernel_lanes.h"

const dfm::DenseKernels &dfm::dense_kernels_avx2() { return kKernels; }
