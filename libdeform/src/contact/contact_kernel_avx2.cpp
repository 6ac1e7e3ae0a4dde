// Four doubles in one register.
#include <stdint.h>

namespace dfm {
namespace {
constexpr uint32_t kWidth = 4;
}
}  // namespace dfm

#include "contact_kernel_lanes.h"

namespace dfm {
const ContactKernels &contact_kernels_avx2() { return kKernels; }
}  // namespace dfm
