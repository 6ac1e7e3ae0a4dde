// Four doubles in one register.
#include "../model_common/lanes_avx.h"

#include "msm_kernel_quad.h"

namespace msm {
namespace {
constexpr Kernels kKernels = {"avx2",       load_block,   {MSM_SPRINGS(springs)},
                              MSM_BRANCHES, volume_cells, MSM_ROWS,
                              merge_halo,   merge_rows,   add_to_host};
}  // namespace

const Kernels *kernels_avx2() { return &kKernels; }
}  // namespace msm
