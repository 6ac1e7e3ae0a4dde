#include "math/anderson.h"

#include <algorithm>
#include <cmath>

namespace dfm {

bool least_combination(uint32_t count, const double (*gram)[kAndersonWindow], double *y, double *gamma) {
  double l[kAndersonWindow][kAndersonWindow], trace = 0;
  for (uint32_t j = 0; j < count; ++j) trace += gram[j][j];
  for (uint32_t j = 0; j < count; ++j) {
    for (uint32_t k = 0; k <= j; ++k) {
      double sum = gram[j][k] + (j == k ? 1e-12 * trace : 0);
      for (uint32_t m = 0; m < k; ++m) sum -= l[j][m] * l[k][m];
      if (j != k) l[j][k] = sum / l[k][k];
      else if (sum > 0) l[j][j] = std::sqrt(sum);
      else return false;
    }
    for (uint32_t k = 0; k < j; ++k) y[j] -= l[j][k] * y[k];
    y[j] /= l[j][j];
  }
  for (uint32_t j = count; j-- > 0;) {
    for (uint32_t k = j + 1; k < count; ++k) y[j] -= l[k][j] * gamma[k];
    gamma[j] = y[j] / l[j][j];
  }
  return true;
}

Anderson::Anderson(const Memory &memory) { use_memory(memory, x_, f_, dx_, df_); }

void Anderson::start(size_t n) {
  n_ = n;
  count_ = slot_ = 0;
  first_ = true;
  x_.resize(n);
  f_.resize(n);
  dx_.resize(kAndersonWindow * n);
  df_.resize(kAndersonWindow * n);
}

void Anderson::next(const double *x, const double *f, const double *weight, double *d) {
  const auto product = [&](const double *a, const double *b) {
    double sum = 0;
    for (size_t k = 0; k < n_; ++k) sum += weight[k] * (a[k] * b[k]);
    return sum;
  };
  if (!first_) {
    double *const dx = &dx_[slot_ * n_], *const df = &df_[slot_ * n_];
    for (size_t k = 0; k < n_; ++k) {
      dx[k] = x[k] - x_[k];
      df[k] = f[k] - f_[k];
    }
    count_ = std::max(count_, slot_ + 1);
    for (uint32_t j = 0; j < count_; ++j) gram_[j][slot_] = gram_[slot_][j] = product(&df_[j * n_], df);
    slot_ = (slot_ + 1) % kAndersonWindow;
  }
  first_ = false;
  std::copy_n(x, n_, x_.begin());
  std::copy_n(f, n_, f_.begin());
  double y[kAndersonWindow], gamma[kAndersonWindow] = {};
  for (uint32_t j = 0; j < count_; ++j) y[j] = product(&df_[j * n_], f);
  const bool usable = count_ > 0 && least_combination(count_, gram_, y, gamma);
  std::copy_n(f_.begin(), n_, d);
  for (uint32_t j = 0; usable && j < count_; ++j)
    for (size_t k = 0; k < n_; ++k) d[k] -= gamma[j] * (dx_[j * n_ + k] + df_[j * n_ + k]);
}

}  // namespace dfm
