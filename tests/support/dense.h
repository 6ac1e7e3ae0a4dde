// Dense matrices, row-major, for reference values. Compiled with the optimizer, unlike the tests.
#pragma once
#include <cstddef>
#include <random>
#include <vector>

namespace test {

struct Dense {
  size_t rows = 0, columns = 0;
  std::vector<double> value;
  Dense(size_t r, size_t c) : rows(r), columns(c), value(r * c) {}
  double &operator()(size_t r, size_t c) { return value[r * columns + c]; }
  double operator()(size_t r, size_t c) const { return value[r * columns + c]; }
};

Dense operator*(const Dense &a, const Dense &b);
Dense transposed(const Dense &a);
std::vector<double> operator*(const Dense &a, const std::vector<double> &x);

// A symmetric positive definite matrix: B B^T + I / 2, B with entries of a normal distribution of width 1/2.
Dense any_positive(size_t n, std::mt19937 &random);

// x of A x = b by Gaussian elimination with the largest pivot of each column.
std::vector<double> solved(Dense a, std::vector<double> b);

}  // namespace test
