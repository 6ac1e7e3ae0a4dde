// Small dense matrices, row-major, for reference values.
#pragma once
#include <cmath>
#include <cstddef>
#include <random>
#include <utility>
#include <vector>

namespace test {

struct Dense {
  size_t rows = 0, columns = 0;
  std::vector<double> value;
  Dense(size_t r, size_t c) : rows(r), columns(c), value(r * c) {}
  double &operator()(size_t r, size_t c) { return value[r * columns + c]; }
  double operator()(size_t r, size_t c) const { return value[r * columns + c]; }
};

inline Dense operator*(const Dense &a, const Dense &b) {
  Dense out(a.rows, b.columns);
  for (size_t r = 0; r < a.rows; ++r)
    for (size_t k = 0; k < a.columns; ++k)
      for (size_t c = 0; c < b.columns; ++c) out(r, c) += a(r, k) * b(k, c);
  return out;
}

inline Dense transposed(const Dense &a) {
  Dense out(a.columns, a.rows);
  for (size_t r = 0; r < a.rows; ++r)
    for (size_t c = 0; c < a.columns; ++c) out(c, r) = a(r, c);
  return out;
}

inline std::vector<double> operator*(const Dense &a, const std::vector<double> &x) {
  std::vector<double> out(a.rows);
  for (size_t r = 0; r < a.rows; ++r)
    for (size_t c = 0; c < a.columns; ++c) out[r] += a(r, c) * x[c];
  return out;
}

// A symmetric positive definite matrix: B B^T + I / 2, B with entries of a normal distribution of width 1/2.
inline Dense any_positive(size_t n, std::mt19937 &random) {
  std::normal_distribution<double> normal(0, 0.5);
  Dense b(n, n);
  for (double &x : b.value) x = normal(random);
  Dense out = b * transposed(b);
  for (size_t i = 0; i < n; ++i) out(i, i) += 0.5;
  return out;
}

// x of A x = b by Gaussian elimination with the largest pivot of each column.
inline std::vector<double> solved(Dense a, std::vector<double> b) {
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
