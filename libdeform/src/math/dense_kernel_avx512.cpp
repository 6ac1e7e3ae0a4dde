// Eight doubles in one register.
#define DEFORM_WIDTH 8
#include "dense_kernel_lanes.h"

const dfm::DenseKernels &dfm::dense_kernels_avx512() { return kKernels; }
