// Which of the loops compiled for several vector widths this processor runs.
#pragma once
#include "math/block_kernel.h"
#include "math/dense_kernel.h"

namespace dfm {

#if defined(__x86_64__)
inline constexpr bool kHasWider = true;  // than 128 bits: other processors get no such loops
#else
inline constexpr bool kHasWider = false;
#endif

// The widest that this processor supports, or the one that DEFORM_SIMD names (sse2, avx2, avx512) if it is
// supported.
int doubles_at_once();
const DenseKernels &dense_kernels();
const BlockKernels &block_kernels();

}  // namespace dfm
