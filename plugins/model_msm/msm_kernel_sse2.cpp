// The baseline of x86-64: four doubles are two registers.
#include "../model_common/lanes_sse2.h"

#define DEFORM_LANES 4
#include "msm_kernel_energy.h"
#include "msm_kernel_single.h"

namespace msm {
namespace {
constexpr Kernels kKernels = {"sse2",       &single::kKernels,  load_block,  {MSM_SPRINGS(springs)},
                              MSM_BRANCHES, volume_cells<Four>, MSM_ROWS,    merge_halo,
                              merge_rows,   add_to_host,        MSM_ENERGIES};
}  // namespace

const Kernels *kernels_sse2() { return &kKernels; }
}  // namespace msm
