#include "dense.h"

#include <cmath>
#include <utility>

namespace test {

Dense operator*(const Dense &a, const Dense &b) {
  Dense out(a.rows, b.columns);
  for (size_t r = 0; r < a.rows; ++r)
    for (size_t k = 0; k < a.columns; ++k)
      for (size_t c = 0; c < b.columns; ++c) out(r, c) += a(r, k) * b(k, c);
  return out;
}

Dense transposed(const Dense &a) {
  Dense out(a.columns, a.rows);
  for (size_t r = 0; r < a.rows; ++r)
    for (size_t c = 0; c < a.columns; ++c) out(c, r) = a(r, c);
  return out;
}

std::vector<double> operator*(const Dense &a, const std::vector<double> &x) {
  std::vector<double> out(a.rows);
  for (size_t r = 0; r < a.rows; ++r)
    for (size_t c = 0; c < a.columns; ++c) out[r] += a(r, c) * x[c];
  return out;
}

Dense any_positive(size_t n, std::mt19937 &random) {
  std::normal_distribution<double> normal(0, 0.5);
  Dense b(n, n);
  for (double &x : b.value) x = normal(random);
  Dense out = b * transposed(b);
  for (size_t i = 0; i < n; ++i) out(i, i) += 0.5;
  return out;
}

std::vector<double> solved(Dense a, std::vector<double> b) {
  const size_t n = a.rows;
  for (size_t k = 0; k < n; ++k) {
    size_t pivot = k;
    for (size_t r = k + 1; r < n; ++r)
      if (std::fabs(a(r, k)) > std::fabs(a(pivot, k))) pivot = r;
    for (size_t c = 0; c < n; ++c) std::swap(a(k, c), a(pivot, c));
    std::swap(b[k], b[pivot]);
    for (size_t r = k + 1; r < n; ++r) {
      const double factor = a(r, k) / a(k, k);
      for (size_t c = k; c < n; ++c) a(r, c) -= factor * a(k, c);
      b[r] -= factor * b[k];
    }
  }
  for (size_t k = n; k-- > 0;) {
    for (size_t c = k + 1; c < n; ++c) b[k] -= a(k, c) * b[c];
    b[k] /= a(k, k);
  }
  return b;
}

}  // namespace test
