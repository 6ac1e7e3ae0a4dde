#include "math/lanczos.h"

#include <algorithm>
#include <cmath>

#include "math/elementary.h"

namespace dfm {
namespace {

constexpr uint32_t kProducts = 48;

// The largest eigenvalue of the tridiagonal matrix with this diagonal and squares of the entries beside it,
// by bisection (Sturm).
double largest_of_tridiagonal(const std::vector<double> &diagonal, const std::vector<double> &square) {
  double low = 0, high = 0;
  for (size_t i = 0; i < diagonal.size(); ++i) {
    const double left = i > 0 ? std::sqrt(square[i - 1]) : 0;
    const double right = i < square.size() ? std::sqrt(square[i]) : 0;
    high = std::max(high, std::fabs(diagonal[i]) + left + right);
  }
  const auto all_below = [&](double x) {  // the pivots of T - x are all negative
    double pivot = diagonal[0] - x;
    for (size_t i = 1; pivot < 0 && i < diagonal.size(); ++i) pivot = diagonal[i] - x - square[i - 1] / pivot;
    return pivot < 0;
  };
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (all_below(middle) ? high : low) = middle;
  }
  return high;
}

}  // namespace

double largest_eigenvalue(size_t n, const Product &product) {
  std::vector<double> now(n), last(n), next(n);
  uint64_t random = 1;
  double length = 0;
  for (double &x : now) {
    random = random * 6364136223846793005u + 1442695040888963407u;  // Knuth's MMIX
    x = double(random >> 11) * 0x1p-52 - 1;
    length += x * x;
  }
  for (double &x : now) x /= std::sqrt(length);
  std::vector<double> diagonal, square;
  double beside = 0;
  for (uint32_t k = 0; k < kProducts; ++k) {
    if (!product(now, next)) return -1;
    double alpha = 0;
    for (size_t i = 0; i < n; ++i) alpha += next[i] * now[i];
    diagonal.push_back(alpha);
    double rest = 0;
    for (size_t i = 0; i < n; ++i) {
      next[i] -= alpha * now[i] + beside * last[i];
      rest += next[i] * next[i];
    }
    beside = std::sqrt(rest);
    if (k + 1 == kProducts || !(beside > 1e-9 * std::fabs(alpha))) break;  // all of it is known
    square.push_back(rest);
    last.swap(now);
    for (size_t i = 0; i < n; ++i) now[i] = next[i] / beside;
  }
  const double steps = kProducts - 1, error = dfm_log(double(n)) / steps + 4 * dfm_log(steps) / steps;
  return largest_of_tridiagonal(diagonal, square) * (1 + 0.103 * error * error);
}

}  // namespace dfm
