// Four doubles in one register.
#define DEFORM_WIDTH 4
#include "points_kernel_lanes.h"

const dfm::PointsKernels &dfm::points_kernels_avx2() { return kKernels; }
