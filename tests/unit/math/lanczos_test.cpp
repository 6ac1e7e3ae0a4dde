// The largest eigenvalue by Lanczos' method: at least the true one, and not much more.
#include "math/lanczos.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace {

// n equal masses on a line, joined by springs: 4 k / m cos^2(pi / 2n) is the largest.
double of_chain(size_t n, double k) {
  return dfm::largest_eigenvalue(n, [&](const std::vector<double> &x, std::vector<double> &y) {
    for (size_t i = 0; i < n; ++i)
      y[i] = k * ((i > 0 ? x[i] - x[i - 1] : 0) + (i + 1 < n ? x[i] - x[i + 1] : 0));
    return true;
  });
}

TEST(Lanczos, LargestOfAChain_IsBoundedWithinAFewPercent) {
  for (const size_t n : {2, 3, 10, 100, 3000}) {
    const double c = std::cos(std::numbers::pi / (2.0 * double(n))), most = 4e5 * c * c;
    const double found = of_chain(n, 1e5);
    EXPECT_GE(found, most * (1 - 1e-12)) << n;
    EXPECT_LT(found, 1.05 * most) << n;
  }
}

TEST(Lanczos, ProductThatFails_IsReported) {
  EXPECT_LT(dfm::largest_eigenvalue(3, [](const auto &, auto &) { return false; }), 0);
}

}  // namespace
