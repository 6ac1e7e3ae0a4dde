#include "dynamics/backed_matrix.h"

#include <algorithm>

#include "math/vec3.h"

namespace dfm {

BackedMatrix::BackedMatrix(const Memory &memory, const BlockPattern &pattern,
                           std::unique_ptr<LinearSolver> solver)
    : pattern_(pattern), solver_(std::move(solver)) {
  use_memory(memory, begin_, other_, block_, blocks_, b_, x_);
  begin_.assign(size_t{pattern.n} + 1, 0);
  other_.resize(pattern.nb);
  block_.resize(pattern.nb);
  for (uint32_t b = 0; b < pattern.nb; ++b) ++begin_[pattern.ij[2 * size_t{b}] + 1];
  for (uint32_t i = 0; i < pattern.n; ++i) begin_[i + 1] += begin_[i];
  Array<uint32_t> next(begin_);
  for (uint32_t b = 0; b < pattern.nb; ++b) block_[next[pattern.ij[2 * size_t{b}]]++] = b;
  const auto second = [&](uint32_t b) { return pattern.ij[2 * size_t{b} + 1]; };
  for (uint32_t i = 0; i < pattern.n; ++i)
    std::sort(block_.begin() + begin_[i], block_.begin() + begin_[i + 1],
              [&](uint32_t a, uint32_t b) { return second(a) < second(b); });
  for (uint32_t k = 0; k < pattern.nb; ++k) other_[k] = second(block_[k]);
  blocks_.resize(size_t{9} * pattern.nb);
  b_.resize(size_t{3} * pattern.n);
  x_.resize(size_t{3} * pattern.n);
}

double *BackedMatrix::find(uint32_t i, uint32_t j) {
  const auto first = other_.begin() + begin_[i], last = other_.begin() + begin_[i + 1];
  const auto at = std::lower_bound(first, last, j);
  return at != last && *at == j ? &blocks_[9 * size_t{block_[size_t(at - other_.begin())]}] : nullptr;
}

bool BackedMatrix::factor(const double *base, const uint8_t *held, const Surface &surface,
                          const Backing &contacts) {
  std::copy_n(base, blocks_.size(), blocks_.begin());
  bool known = true;
  for (uint32_t c = 0; c < contacts.n; ++c) {
    const double *const k = &contacts.stiffness[size_t{9} * c];
    for (uint32_t a = contacts.begin[c]; a < contacts.begin[c + 1]; ++a)
      for (uint32_t b = contacts.begin[c]; b < contacts.begin[c + 1]; ++b)
        surface.each_phyxel(contacts.surfel[a], [&](uint32_t p, double wp) {
          surface.each_phyxel(contacts.surfel[b], [&](uint32_t q, double wq) {
            if (p > q) return;
            double *const to = find(p, q);
            const double share = contacts.weight[a] * wp * contacts.weight[b] * wq;
            if (to)
              for (size_t e = 0; e < 9; ++e) to[e] += share * k[e];
            known = known && to;
          });
        });
  }
  if (!known) return false;
  hold_components(pattern_, held, blocks_.data());
  return solver_->factor(blocks_.data());
}

bool BackedMatrix::solve(const uint8_t *held, const Surface &surface, const Backing &contacts,
                         const double *impulse, double *change) {
  std::fill(b_.begin(), b_.end(), 0.0);
  const auto each = [&](auto &&f) {
    for (uint32_t c = 0; c < contacts.n; ++c)
      for (uint32_t a = contacts.begin[c]; a < contacts.begin[c + 1]; ++a)
        surface.each_phyxel(contacts.surfel[a],
                            [&](uint32_t p, double w) { f(size_t{3} * c, p, contacts.weight[a] * w); });
  };
  each([&](size_t at, uint32_t p, double w) {
    for (uint32_t c = 0; c < 3; ++c)
      if (!(held[p] & (1 << c))) b_[size_t{3} * p + c] += w * impulse[at + c];
  });
  SolveInfo info;
  if (!solver_->solve(1, b_.data(), x_.data(), 0, info)) return false;
  std::fill_n(change, size_t{3} * contacts.n, 0.0);
  each([&](size_t at, uint32_t p, double w) {
    for (uint32_t c = 0; c < 3; ++c)
      if (!(held[p] & (1 << c))) change[at + c] += w * x_[size_t{3} * p + c];
  });
  return true;
}

}  // namespace dfm
