// The largest eigenvalue of a symmetric operator, by Lanczos' method.
#pragma once
#include <cstddef>
#include <functional>
#include <vector>

namespace dfm {

// y = A x, of n numbers. False: it failed.
using Product = std::function<bool(const std::vector<double> &x, std::vector<double> &y)>;

// At least the largest eigenvalue of A, where that is not negative; < 0: a product failed. The largest Ritz
// value from a start vector that knows nothing of A is too small by a share that has the expectation
// 0.103 (ln(n (k - 1)^4) / (k - 1))^2 at most after k products (Kuczynski and Wozniakowski 1992, theorem
// 3.2); that share is added.
double largest_eigenvalue(size_t n, const Product &product);

}  // namespace dfm
