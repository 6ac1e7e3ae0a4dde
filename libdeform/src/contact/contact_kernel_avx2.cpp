// Four doubles in one register.
#define DEFORM_WIDTH 4
#include "contact_kernel_lanes.h"

const dfm::ContactKernels &dfm::contact_kernels_avx2() { return kKernels; }
