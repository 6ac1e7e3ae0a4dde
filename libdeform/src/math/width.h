// Which of the loops compiled for several vector widths this processor runs.
#pragma once
#include "math/block_kernel.h"
#include "math/dense_kernel.h"

namespace dfm {

// The widest that this processor has, or what DEFORM_SIMD (sse2, avx2, avx512) asks for where it has that.
int doubles_at_once();
const DenseKernels &dense_kernels();
const BlockKernels &block_kernels();

}  // namespace dfm
