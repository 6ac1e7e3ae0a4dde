// Two doubles in one register.
#define DEFORM_WIDTH 2
#include "contact_kernel_lanes.h"

const dfm::ContactKernels &dfm::contact_kernels_sse2() { return kKernels; }
