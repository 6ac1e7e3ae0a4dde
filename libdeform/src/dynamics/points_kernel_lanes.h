// The loops of points_kernel.h for vectors of kWidth (2 or 4) doubles, which the including file defines.
#pragma once
#include <stddef.h>

#include "math/kernel_vector.h"
#include "points_kernel.h"

namespace dfm {
namespace {

constexpr uint32_t kParts = 4 / kWidth;  // vectors that hold a point

double predict(uint32_t n, double h, const double *gravity, const double *mass, const double *v,
               const double *w, const double *f, double *free) {
  const Vector step = splat(h);
  Vector g[kParts], square[2][kParts] = {};  // two sums, so that one addition does not wait for the other
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) g[p] = load(gravity + p * kWidth);
  const auto one = [&](uint32_t i, uint32_t sum) __attribute__((always_inline)) {
    const Vector m = splat(mass[i]);
    DEFORM_UNROLL
    for (uint32_t p = 0; p < kParts; ++p) {
      const size_t at = 4 * size_t(i) + p * kWidth;
      const Vector u = load(v + at) + step * (load(w + at) * (load(f + at) + m * g[p]));
      store(free + at, u);
      square[sum][p] += m * (u * u);
    }
  };
  uint32_t i = 0;
  for (; i + 2 <= n; i += 2) {
    one(i, 0);
    one(i + 1, 1);
  }
  if (i < n) one(i, 0);
  double sum[4];
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) store(sum + p * kWidth, square[0][p] + square[1][p]);
  return 0.5 * ((sum[0] + sum[1]) + sum[2]);
}

void end(uint32_t n, double h, const double *x, const double *free, const double *w, const double *impulse,
         double *x_end, double *v_end) {
  const Vector step = splat(h);
  if (impulse) {
    for (size_t at = 0; at < 4 * size_t(n); at += kWidth) {
      const Vector u = load(free + at) + load(w + at) * load(impulse + at);
      store(v_end + at, u);
      store(x_end + at, load(x + at) + step * u);
    }
    return;
  }
  for (size_t at = 0; at < 4 * size_t(n); at += kWidth) {
    const Vector u = load(free + at);
    store(v_end + at, u);
    store(x_end + at, load(x + at) + step * u);
  }
}

constexpr PointsKernels kKernels = {predict, end};

}  // namespace
}  // namespace dfm
