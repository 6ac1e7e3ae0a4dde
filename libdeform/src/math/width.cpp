#include "math/width.h"

#include <cstdlib>
#include <cstring>

namespace dfm {

int doubles_at_once() {
  const bool avx2 = __builtin_cpu_supports("avx2");
  const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                      __builtin_cpu_supports("avx512dq");
  const char *const asked = std::getenv("DEFORM_SIMD");
  if (asked && std::strcmp(asked, "sse2") == 0) return 2;
  if (asked && std::strcmp(asked, "avx2") == 0 && avx2) return 4;
  return avx512 ? 8 : avx2 ? 4 : 2;
}

const DenseKernels &dense_kernels() {
  const int width = doubles_at_once();
  return width == 8 ? dense_kernels_avx512() : width == 4 ? dense_kernels_avx2() : dense_kernels_sse2();
}

// A row of a block has three doubles: vectors of eight would be half empty.
const BlockKernels &block_kernels() {
  return doubles_at_once() >= 4 ? block_kernels_avx2() : block_kernels_sse2();
}

}  // namespace dfm
