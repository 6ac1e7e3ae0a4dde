#include <algorithm>

#include "sparse.h"

namespace reduced {

void Factor::solve(const double *b, double *x) const {
  double *const y = ordered_.data();
  for (size_t i = 0; i < n_; ++i)
    for (size_t k = 0; k < 3; ++k) y[3 * size_t(place_[i]) + k] = b[3 * i + k];
  for (size_t j = 0; j < n_; ++j) {
    const uint32_t first = begin_[j];
    const double *const d = block_.data() + 9 * size_t(first);
    double *const own = y + 3 * j;
    own[0] /= d[0];
    own[1] = (own[1] - d[3] * own[0]) / d[4];
    own[2] = ((own[2] - d[6] * own[0]) - d[7] * own[1]) / d[8];
    const double y0 = own[0], y1 = own[1], y2 = own[2];
    for (uint32_t s = first + 1; s < begin_[j + 1]; ++s) {
      const double *const l = block_.data() + 9 * size_t(s);
      double *const to = y + 3 * size_t(row_[s]);
      to[0] -= (l[0] * y0 + l[1] * y1) + l[2] * y2;
      to[1] -= (l[3] * y0 + l[4] * y1) + l[5] * y2;
      to[2] -= (l[6] * y0 + l[7] * y1) + l[8] * y2;
    }
  }
  for (size_t j = n_; j-- > 0;) {
    const uint32_t first = begin_[j];
    double *const own = y + 3 * j;
    double y0 = own[0], y1 = own[1], y2 = own[2];
    for (uint32_t s = first + 1; s < begin_[j + 1]; ++s) {
      const double *const l = block_.data() + 9 * size_t(s);
      const double *const from = y + 3 * size_t(row_[s]);
      y0 -= (l[0] * from[0] + l[3] * from[1]) + l[6] * from[2];
      y1 -= (l[1] * from[0] + l[4] * from[1]) + l[7] * from[2];
      y2 -= (l[2] * from[0] + l[5] * from[1]) + l[8] * from[2];
    }
    const double *const d = block_.data() + 9 * size_t(first);
    own[2] = y2 / d[8];
    own[1] = (y1 - d[7] * own[2]) / d[4];
    own[0] = ((y0 - d[3] * own[1]) - d[6] * own[2]) / d[0];
  }
  for (size_t i = 0; i < n_; ++i)
    for (size_t k = 0; k < 3; ++k) x[3 * i + k] = y[3 * size_t(place_[i]) + k];
}

// Numbers of one entry lie side by side.
void Factor::solve_eight(const Kernels &kernels, const double *b, double *x) const {
  constexpr size_t kPoint = 3 * kLanes;
  double *const y = ordered_.data();
  for (size_t i = 0; i < n_; ++i) std::copy(b + kPoint * i, b + kPoint * (i + 1), y + kPoint * place_[i]);
  kernels.solve({n_, begin_.data(), row_.data(), block_.data()}, y);
  for (size_t i = 0; i < n_; ++i)
    std::copy(y + kPoint * place_[i], y + kPoint * (size_t(place_[i]) + 1), x + kPoint * i);
}

}  // namespace reduced
