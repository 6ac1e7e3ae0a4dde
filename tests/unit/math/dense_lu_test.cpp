#include "math/dense_lu.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

namespace {

using namespace dfm;

double next(uint64_t &seed) {
  seed = seed * 6364136223846793005ull + 1442695040888963407ull;
  return 2 * (double(seed >> 11) / 9007199254740992.0) - 1;
}

// Without a diagonal that dominates, so pivots are needed; `share` of the elements are not zero.
void check(size_t n, double share) {
  SCOPED_TRACE(n);
  uint64_t seed = 17 * n;
  const size_t row = lu_row(n);
  std::vector<double> a(n * row, 0.0), x(n), b;
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j < n; ++j)
      if (std::fabs(next(seed)) < share || j == (i + 1) % n) a[i * row + j] = next(seed);
    x[i] = next(seed);
  }
  b = x;
  std::vector<double> work = a;
  std::vector<size_t> live;
  ASSERT_TRUE(solve_lu(n, work.data(), x.data(), live));
  double left = 0, most = 0;
  for (size_t i = 0; i < n; ++i) {
    double sum = -b[i];
    for (size_t j = 0; j < n; ++j) sum += a[i * row + j] * x[j];
    left = std::max(left, std::fabs(sum));
    most = std::max(most, std::fabs(x[i]));
  }
  EXPECT_LT(left, 1e-12 * most * double(n));
}

}  // namespace

TEST(DenseLu, SolvesFullAndSparseSystems) {
  for (const size_t n : {1, 5, 6, 7, 8, 9, 13, 16, 31, 60, 120})
    for (const double share : {1.0, 0.1}) check(n, share);
}

TEST(DenseLu, SaysThatASystemIsSingular) {
  for (const size_t n : {1, 8, 20}) {
    std::vector<double> a(n * lu_row(n), 0.0), x(n, 1.0);
    for (size_t i = 0; i + 1 < n; ++i) a[i * lu_row(n) + i] = 1;
    std::vector<size_t> live;
    EXPECT_FALSE(solve_lu(n, a.data(), x.data(), live));
  }
}
