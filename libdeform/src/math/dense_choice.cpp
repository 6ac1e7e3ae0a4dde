#include <cstdlib>
#include <cstring>

#include "math/dense_kernel.h"

namespace dfm {

const DenseKernels &dense_kernels() {
  const bool avx2 = __builtin_cpu_supports("avx2");
  const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                      __builtin_cpu_supports("avx512dq");
  const char *const asked = std::getenv("DEFORM_SIMD");
  const auto is = [&](const char *name) { return asked && std::strcmp(asked, name) == 0; };
  if (is("sse2")) return dense_kernels_sse2();
  if (is("avx2") && avx2) return dense_kernels_avx2();
  return avx512 ? dense_kernels_avx512() : avx2 ? dense_kernels_avx2() : dense_kernels_sse2();
}

}  // namespace dfm
