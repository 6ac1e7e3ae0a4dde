#include "math/anderson.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dfm {
namespace {

// One sum would wait for each addition; four sums run in parallel.
double product(size_t n, const double *a, const double *b) {
  double sum[4] = {};
  size_t k = 0;
  for (; k + 4 <= n; k += 4)
    for (size_t i = 0; i < 4; ++i) sum[i] += a[k + i] * b[k + i];
  for (; k < n; ++k) sum[k % 4] += a[k] * b[k];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

// to -= by a
void subtract(size_t n, double by, const double *a, double *to) {
  for (size_t k = 0; k < n; ++k) to[k] -= by * a[k];
}

}  // namespace

// The gamma that minimizes |f - sum gamma_j df_j|, from y = df_j . f (overwritten), by the normal equations,
// slightly regularized, and Cholesky. False: the result is not usable.
bool Anderson::combination(double (&y)[kWindow], double (&gamma)[kWindow]) const {
  double l[kWindow][kWindow], trace = 0;
  for (uint32_t j = 0; j < count_; ++j) trace += gram_[j][j];
  for (uint32_t j = 0; j < count_; ++j) {
    for (uint32_t k = 0; k <= j; ++k) {
      double sum = gram_[j][k] + (j == k ? 1e-12 * trace : 0);
      for (uint32_t m = 0; m < k; ++m) sum -= l[j][m] * l[k][m];
      if (j != k) l[j][k] = sum / l[k][k];
      else if (sum > 0) l[j][j] = std::sqrt(sum);
      else return false;
    }
    for (uint32_t k = 0; k < j; ++k) y[j] -= l[j][k] * y[k];
    y[j] /= l[j][j];
  }
  for (uint32_t j = count_; j-- > 0;) {
    for (uint32_t k = j + 1; k < count_; ++k) y[j] -= l[k][j] * gamma[k];
    gamma[j] = y[j] / l[j][j];
  }
  return true;
}

Anderson::Anderson(const Memory &memory) { use_memory(memory, metric_, f_, g_, df_, dg_); }

void Anderson::start(std::span<const double> weights, double growth) {
  const size_t n = weights.size();
  count_ = slot_ = 0;
  first_ = true;
  growth_ = growth;
  metric_.resize(n);
  for (size_t k = 0; k < n; ++k) metric_[k] = std::sqrt(weights[k]);
  for (Array<double> *a : {&f_, &g_}) a->resize(n);
  for (Array<double> *a : {&df_, &dg_}) a->resize(kWindow * n);
}

bool Anderson::next(const double *x, const double *g, double *jump) {
  const size_t n = metric_.size();
  double *const df = &df_[slot_ * n], *const dg = &dg_[slot_ * n];
  for (size_t k = 0; k < n; ++k) {
    const double f = metric_[k] * (g[k] - x[k]);
    df[k] = f - f_[k];
    dg[k] = g[k] - g_[k];
    f_[k] = f;
    g_[k] = g[k];
  }
  const double size = product(n, f_.data(), f_.data());
  const bool other = size > growth_ * std::exchange(last_, size);
  if (std::exchange(first_, false)) return false;
  if (other) {
    count_ = slot_ = 0;
    return false;
  }
  count_ = std::max(count_, slot_ + 1);
  double y[kWindow], gamma[kWindow] = {};
  for (uint32_t j = 0; j < count_; ++j) {
    gram_[j][slot_] = gram_[slot_][j] = product(n, &df_[j * n], df);
    y[j] = product(n, &df_[j * n], f_.data());
  }
  slot_ = (slot_ + 1) % kWindow;
  if (!combination(y, gamma)) return false;
  std::fill_n(jump, n, 0.0);
  for (uint32_t j = 0; j < count_; ++j) subtract(n, gamma[j], &dg_[j * n], jump);
  return true;
}

}  // namespace dfm
