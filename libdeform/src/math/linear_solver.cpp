#include "math/linear_solver.h"

#include <algorithm>

namespace dfm {

bool RestrictedBySolving::run(LinearSolver &solver, uint32_t points, uint32_t nsel, const uint32_t *sel,
                              double tolerance, double *w, SolveInfo &info) {
  constexpr uint32_t kTogether = 16;
  const size_t rows = 3 * size_t{points}, wide = 3 * size_t{nsel};
  b_.assign(kTogether * rows, 0.0);
  x_.resize(kTogether * rows);
  info = {};
  bool good = true;
  const auto at = [&](size_t c) { return 3 * size_t{sel[c / 3]} + c % 3; };
  for (size_t first = 0; first < wide; first += kTogether) {
    const uint32_t count = uint32_t(std::min<size_t>(kTogether, wide - first));
    for (uint32_t k = 0; k < count; ++k) b_[k * rows + at(first + k)] = 1.0;
    std::fill(x_.begin(), x_.end(), 0.0);
    SolveInfo own;
    good = solver.solve(count, b_.data(), x_.data(), tolerance, own) && good;
    info.iterations += own.iterations;
    info.residual = std::max(info.residual, own.residual);
    info.indefinite = info.indefinite || own.indefinite;
    for (uint32_t k = 0; k < count; ++k) {
      b_[k * rows + at(first + k)] = 0.0;
      for (size_t r = 0; r < wide; ++r) w[(first + k) * wide + r] = x_[k * rows + at(r)];
    }
  }
  for (size_t r = 0; r < wide; ++r)  // symmetric to the last bit, whatever the tolerance left
    for (size_t c = 0; c < r; ++c) {
      const double mean = 0.5 * (w[r * wide + c] + w[c * wide + r]);
      w[r * wide + c] = w[c * wide + r] = mean;
    }
  return good;
}

}  // namespace dfm
