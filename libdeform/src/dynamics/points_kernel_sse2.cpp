// Two doubles in one register.
#define DEFORM_WIDTH 2
#include "points_kernel_lanes.h"

const dfm::PointsKernels &dfm::points_kernels_sse2() { return kKernels; }
