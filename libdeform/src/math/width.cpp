#include "math/width.h"

#include <cstdlib>
#include <cstring>

namespace dfm {

int doubles_at_once() {
#if defined(__x86_64__)
  const bool avx2 = __builtin_cpu_supports("avx2");
  const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                      __builtin_cpu_supports("avx512dq");
  const char *const requested = std::getenv("DEFORM_SIMD");
  if (requested && std::strcmp(requested, "sse2") == 0) return 2;
  if (requested && std::strcmp(requested, "avx2") == 0 && avx2) return 4;
  return avx512 ? 8 : avx2 ? 4 : 2;
#else
  return 2;
#endif
}

const DenseKernels &dense_kernels() {
  if constexpr (kHasWider) {
    const int width = doubles_at_once();
    if (width > 2) return width == 8 ? dense_kernels_avx512() : dense_kernels_avx2();
  }
  return dense_kernels_sse2();
}

// A row of a block has three doubles: vectors of eight would be half empty.
const BlockKernels &block_kernels() {
  if constexpr (kHasWider) {
    if (doubles_at_once() >= 4) return block_kernels_avx2();
  }
  return block_kernels_sse2();
}

}  // namespace dfm
