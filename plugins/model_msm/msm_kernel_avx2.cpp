// Four doubles in one register.
#include "../model_common/lanes_avx.h"

#define DEFORM_LANES 8
#include "msm_kernel_energy.h"
#include "msm_kernel_single.h"

namespace msm {
namespace {
constexpr Kernels kKernels = {"avx2",       &single::kKernels,  load_block,  {MSM_SPRINGS(springs)},
                              MSM_BRANCHES, volume_cells<Four>, MSM_ROWS,    merge_halo,
                              merge_rows,   add_to_host,        MSM_ENERGIES};
}  // namespace

const Kernels *kernels_avx2() { return &kKernels; }
}  // namespace msm
