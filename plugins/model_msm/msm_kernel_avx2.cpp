// Four doubles in one register.
#include "msm_kernel_lanes_avx.h"

#include "msm_kernel_quad.h"

namespace msm {
namespace {
constexpr Kernels kKernels = {"avx2", load_block, plain_springs, damped_springs, volume_cells,
                              spring_rows, cell_rows, merge_halo, merge_rows, add_to_host};
}  // namespace

const Kernels *kernels_avx2() { return &kKernels; }
}  // namespace msm
