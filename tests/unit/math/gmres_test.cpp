// GMRES of contact steps: what it claims is left of the residual is what the solution leaves.
#include "math/gmres.h"

#include <gtest/gtest.h>

#include <vector>

namespace {

using namespace dfm;

constexpr size_t kSize = 60;

// tridiagonal, not symmetric
void multiply(const double *in, double *out) {
  for (size_t k = 0; k < kSize; ++k) {
    out[k] = (2.1 + 0.1 * double(k)) * in[k];
    if (k > 0) out[k] -= 1.2 * in[k - 1];
    if (k + 1 < kSize) out[k] -= 0.7 * in[k + 1];
  }
}

TEST(Gmres, APreconditionerThatChanges_LeavesWhatIsClaimed) {
  std::vector<double> b(kSize), x(kSize), product(kSize);
  for (size_t k = 0; k < kSize; ++k) b[k] = 1.0 + double(k % 7);
  uint32_t calls = 0;
  const auto precondition = [&](const double *in, double *out) {
    ++calls;
    for (size_t k = 0; k < kSize; ++k) out[k] = in[k] / (1.0 + double((k + calls) % 3));
  };
  Gmres gmres(Memory::standard());
  const Gmres::Result found = gmres.run(kSize, b.data(), x.data(), 1e-6, 50, false, multiply, precondition);
  EXPECT_LE(found.left, 1e-6);
  multiply(x.data(), product.data());
  double left = 0, all = 0;
  for (size_t k = 0; k < kSize; ++k) {
    left += (b[k] - product[k]) * (b[k] - product[k]);
    all += b[k] * b[k];
  }
  EXPECT_LE(std::sqrt(left / all), 2e-6);
}

}  // namespace
