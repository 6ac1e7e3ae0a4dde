// Generalized minimal residuals (Saad and Schultz 1986) for matrices that are known by their products, with a
// preconditioner on the right, which need not be linear (flexible: Saad 1993).
#pragma once
#include <cmath>
#include <cstddef>

#include "core/memory.h"

namespace dfm {

class Gmres {
 public:
  explicit Gmres(const Memory &memory) { use_memory(memory, basis_, product_, hessenberg_, turn_, right_); }

  struct Result {
    uint32_t iterations = 0;
    double left = 1;  // residual over |b|
  };
  // x = P y with A P y ~ b, from x = 0, until the residual is `relative` of |b|, or `most` iterations are
  // done. multiply(in, out): out = A in; precondition(in, out): out = P in. linear: P is; else what P gave
  // is stored, and x is a sum of it.
  template <class Multiply, class Precondition>
  Result run(size_t n, const double *b, double *x, double relative, uint32_t most, bool linear,
             const Multiply &multiply, const Precondition &precondition);

 private:
  Array<double> basis_, product_;  // [most+1,n], [n] or [most,n]
  Array<double> hessenberg_;       // [most,most+1], column after column
  Array<double> turn_, right_;     // rotations (cosine, sine); right-hand side

  static double dot(size_t n, const double *a, const double *b) {
    double sum[4] = {0, 0, 0, 0};
    size_t k = 0;
    for (; k + 4 <= n; k += 4)
      for (size_t c = 0; c < 4; ++c) sum[c] += a[k + c] * b[k + c];
    for (; k < n; ++k) sum[0] += a[k] * b[k];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
  }
};

template <class Multiply, class Precondition>
Gmres::Result Gmres::run(size_t n, const double *b, double *x, double relative, uint32_t most, bool linear,
                         const Multiply &multiply, const Precondition &precondition) {
  Result out;
  std::fill_n(x, n, 0.0);
  const double size = std::sqrt(dot(n, b, b));
  if (!(size > 0)) return {0, 0};
  basis_.resize(n * (size_t{most} + 1));
  const auto product = [&](uint32_t i) { return &product_[linear ? 0 : n * i]; };
  product_.resize(linear ? n : n * most);
  hessenberg_.assign(size_t{most} * (most + 1), 0.0);
  turn_.resize(2 * size_t{most});
  right_.assign(size_t{most} + 1, 0.0);
  right_[0] = size;
  for (size_t k = 0; k < n; ++k) basis_[k] = b[k] / size;
  uint32_t j = 0;
  while (j < most) {
    double *const h = &hessenberg_[size_t{j} * (most + 1)];
    double *const next = &basis_[n * (j + 1)];
    precondition(&basis_[n * j], product(j));
    multiply(product(j), next);
    for (uint32_t i = 0; i <= j; ++i) {
      const double *const q = &basis_[n * i];
      h[i] = dot(n, q, next);
      for (size_t k = 0; k < n; ++k) next[k] -= h[i] * q[k];
    }
    h[j + 1] = std::sqrt(dot(n, next, next));
    if (h[j + 1] > 0)
      for (size_t k = 0; k < n; ++k) next[k] /= h[j + 1];
    for (uint32_t i = 0; i < j; ++i) {
      const double c = turn_[2 * i], s = turn_[2 * i + 1], up = h[i];
      h[i] = c * up + s * h[i + 1];
      h[i + 1] = -s * up + c * h[i + 1];
    }
    const double radius = std::sqrt(h[j] * h[j] + h[j + 1] * h[j + 1]);
    if (!(radius > 0)) break;
    const double c = h[j] / radius, s = h[j + 1] / radius;
    turn_[2 * j] = c;
    turn_[2 * j + 1] = s;
    h[j] = radius;
    right_[j + 1] = -s * right_[j];
    right_[j] *= c;
    ++j;
    out.left = std::fabs(right_[j]) / size;
    if (out.left <= relative || s == 0) break;
  }
  out.iterations = j;
  for (uint32_t i = j; i-- > 0;) {
    for (uint32_t k = i + 1; k < j; ++k) right_[i] -= hessenberg_[size_t{k} * (most + 1) + i] * right_[k];
    right_[i] /= hessenberg_[size_t{i} * (most + 1) + i];
  }
  if (linear) std::fill_n(product_.begin(), n, 0.0);
  double *const sum = linear ? product_.data() : x;
  for (uint32_t i = 0; i < j; ++i) {
    const double *const add = linear ? &basis_[n * i] : product(i);
    for (size_t k = 0; k < n; ++k) sum[k] += right_[i] * add[k];
  }
  if (linear) precondition(sum, x);
  return out;
}

}  // namespace dfm
