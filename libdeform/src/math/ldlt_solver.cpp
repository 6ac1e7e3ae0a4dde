#include "math/ldlt_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "math/nested_dissection.h"
#include "math/width.h"

namespace dfm {

namespace {

// Pivots below this share of the diagonal are rounding: the matrix is singular in double precision.
constexpr double kPivot = 64 * std::numeric_limits<double>::epsilon();
constexpr uint32_t kBlock = 24;         // columns of a panel that are factored at a time
constexpr uint32_t kChunk = 96;         // columns that one pass over an update takes
constexpr double kShared = 1.0e6;       // multiplications; below that threads cost more than they save
constexpr uint32_t kTilesPerShare = 4;  // of kTileColumns columns

size_t rounded(size_t n) { return (n + kTileRows - 1) / kTileRows * kTileRows; }

}  // namespace

LdltSolver::LdltSolver(const Memory &memory, Tasks *tasks)
    : kernels_(dense_kernels()), tasks_(tasks), nodes_(memory) {
  use_memory(memory, entry_begin_, waiting_, order_, row_, reach_begin_, reach_);
  use_memory(memory, value_, pivot_, inverse_, floor_, stack_, left_, right_, panels_, reached_);
  use_memory(memory, entry_);
  use_memory(memory, reached_begin_);
}

void LdltSolver::analyse(const BlockPattern &pattern) {
  nodes_.build(pattern);
  find_places(pattern);
}

void LdltSolver::analyse(const BlockPattern &pattern, const double *places) {
  std::vector<uint32_t> order(pattern.n);
  nested_dissection(pattern, places, order.data());
  nodes_.build(pattern, order.data());
  find_places(pattern);
}

// Finds the places of the blocks of A in the panels, and allocates the memory of all later calls.
void LdltSolver::find_places(const BlockPattern &pattern) {
  ready_ = false;
  n_ = pattern.n;
  const uint32_t ns = nodes_.count();
  entry_begin_.assign(size_t{ns} + 1, 0);
  const auto column = [&](uint32_t b) {
    return std::min(nodes_.place[pattern.ij[2 * size_t{b}]], nodes_.place[pattern.ij[2 * size_t{b} + 1]]);
  };
  for (uint32_t b = 0; b < pattern.nb; ++b) ++entry_begin_[nodes_.owner[column(b)] + 1];
  for (uint32_t s = 0; s < ns; ++s) entry_begin_[s + 1] += entry_begin_[s];
  entry_.resize(pattern.nb);
  waiting_.assign(entry_begin_.begin(), entry_begin_.end() - 1);
  for (uint32_t b = 0; b < pattern.nb; ++b) {
    const uint32_t i = nodes_.place[pattern.ij[2 * size_t{b}]];
    const uint32_t j = nodes_.place[pattern.ij[2 * size_t{b} + 1]];
    const uint32_t row = std::max(i, j), own = std::min(i, j), s = nodes_.owner[own];
    uint32_t at = row - nodes_.begin[s];
    if (row >= nodes_.begin[s + 1]) {
      const auto first = nodes_.rows.begin() + nodes_.row_begin[s];
      const auto last = nodes_.rows.begin() + nodes_.row_begin[s + 1];
      at = nodes_.width(s) + uint32_t(std::lower_bound(first, last, row) - first);
    }
    const size_t ld = 3 * size_t{nodes_.height(s)};
    entry_[waiting_[s]++] = {3 * size_t{at} + 3 * (own - nodes_.begin[s]) * ld, b, i < j};
  }
  size_t pack = 0;
  for (uint32_t s = 0; s < ns; ++s) pack = std::max(pack, rounded(3 * size_t{nodes_.height(s)}) * kChunk);
  left_.resize(pack);
  right_.resize(pack);
  value_.resize(nodes_.value_begin[ns]);
  stack_.resize(nodes_.stack);
  for (Array<double> *v : {&pivot_, &inverse_, &floor_}) v->assign(3 * size_t{n_}, 0.0);
}

void LdltSolver::assemble(uint32_t s, const double *blk, double *panel) {
  const size_t ld = 3 * size_t{nodes_.height(s)};
  std::fill(panel, panel + 3 * nodes_.width(s) * ld, 0.0);
  for (uint32_t e = entry_begin_[s]; e < entry_begin_[s + 1]; ++e) {
    const double *const a = blk + 9 * size_t{entry_[e].block};
    double *const to = panel + entry_[e].at;
    const uint32_t row = entry_[e].transposed ? 1 : 3, column = 4 - row;
    for (uint32_t c = 0; c < 3; ++c)
      for (uint32_t r = 0; r < 3; ++r) to[r + c * ld] = a[r * row + c * column];
  }
  for (uint32_t k = 0; k < 3 * nodes_.width(s); ++k)
    floor_[3 * size_t{nodes_.begin[s]} + k] = kPivot * panel[k + k * ld];
}

// Adds the update of a child (lower triangle) to the rows of the parent that it belongs to: in the panel, or
// in the parent's own update.
void LdltSolver::extend_add(uint32_t child, const double *update, uint32_t s, double *panel,
                            double *own) const {
  const uint32_t count = nodes_.below(child), width = nodes_.width(s);
  const size_t from_ld = 3 * size_t{count}, ld = 3 * size_t{nodes_.height(s)},
               own_ld = 3 * size_t{nodes_.below(s)};
  const uint32_t *const place = &nodes_.relative[nodes_.row_begin[child]];
  for (uint32_t b = 0; b < count; ++b)
    for (uint32_t c = 0; c < 3; ++c) {
      const double *const from = update + (3 * size_t{b} + c) * from_ld;
      const bool pivot = place[b] < width;
      // own update: its rows begin behind the pivots
      double *const to = pivot ? panel + (3 * size_t{place[b]} + c) * ld
                               : own + (3 * size_t{place[b] - width} + c) * own_ld - 3 * size_t{width};
      for (uint32_t a = b; a < count; ++a)
        for (uint32_t r = 0; r < 3; ++r) to[3 * size_t{place[a]} + r] += from[3 * size_t{a} + r];
    }
}

// C[m rows, columns] -= A D A^T on and below the diagonal, A [m,k]
void LdltSolver::subtract_product(uint32_t m, uint32_t columns, uint32_t k, const double *a, size_t ld,
                                  const double *d, double *c, size_t ldc) {
  for (uint32_t at = 0; at < k; at += kChunk) {
    const uint32_t now = std::min(kChunk, k - at);
    kernels_.pack(m, now, a + at * ld, ld, d + at, left_.data(), right_.data());
    const auto some = [&](uint32_t begin, uint32_t end) {
      kernels_.update(m, begin * kTileColumns, std::min(columns, end * kTileColumns), now, left_.data(),
                      right_.data(), c, ldc);
    };
    const uint32_t tiles = (columns + kTileColumns - 1) / kTileColumns;
    if (tasks_ && double(m) * columns * now > kShared)
      tasks_->parallel_for(tiles, kTilesPerShare, [&](uint32_t begin, uint32_t end) { some(begin, end); });
    else some(0, tiles);
  }
}

bool LdltSolver::factor_panel(uint32_t s, double *panel, double *own) {
  const uint32_t n = 3 * nodes_.width(s), m = 3 * nodes_.height(s), below = m - n;
  const size_t ld = m, first = 3 * size_t{nodes_.begin[s]};
  for (uint32_t j = 0; j < n; j += kBlock) {
    const uint32_t now = std::min(kBlock, n - j), next = j + now;
    double *const block = panel + j * ld;
    if (kernels_.factor(m - j, now, block + j, ld, &pivot_[first + j], &floor_[first + j]) != now)
      return false;
    if (next < n)
      subtract_product(m - next, n - next, now, block + next, ld, &pivot_[first + j],
                       panel + next * ld + next, ld);
  }
  subtract_product(below, below, n, panel + n, ld, &pivot_[first], own, below);
  return true;
}

bool LdltSolver::factor(const double *blk) {
  ready_ = false;
  size_t top = 0;
  uint32_t count = 0;
  for (uint32_t s = 0; s < nodes_.count(); ++s) {
    const auto square = [&](uint32_t node) { return 9 * size_t{nodes_.below(node)} * nodes_.below(node); };
    double *const panel = &value_[nodes_.value_begin[s]], *const own = stack_.data() + top;
    assemble(s, blk, panel);
    std::fill(own, own + square(s), 0.0);
    uint32_t first = count;
    size_t base = top;
    while (first > 0 && nodes_.parent[waiting_[first - 1]] == s) base -= square(waiting_[--first]);
    size_t at = base;
    for (uint32_t c = first; c < count; ++c) {
      extend_add(waiting_[c], stack_.data() + at, s, panel, own);
      at += square(waiting_[c]);
    }
    if (!factor_panel(s, panel, own)) return false;
    if (base != top) std::copy(own, own + square(s), stack_.data() + base);
    top = base + square(s);
    count = first;
    waiting_[count++] = s;
  }
  for (size_t k = 0; k < pivot_.size(); ++k) inverse_[k] = 1 / pivot_[k];
  return ready_ = true;
}

void LdltSolver::solve_one(const double *b, double *x) {
  const size_t rows = 3 * size_t{n_};
  panels_.resize(std::max(panels_.size(), 2 * rows));
  double *const y = panels_.data(), *const scratch = y + rows;
  for (uint32_t i = 0; i < n_; ++i)
    for (uint32_t c = 0; c < 3; ++c) y[3 * size_t{nodes_.place[i]} + c] = b[3 * size_t{i} + c];
  const auto run = [&](auto kernel, uint32_t s) {
    kernel(nodes_.width(s), nodes_.below(s), &value_[nodes_.value_begin[s]],
           nodes_.rows.data() + nodes_.row_begin[s], y + 3 * size_t{nodes_.begin[s]}, y, scratch);
  };
  for (uint32_t s = 0; s < nodes_.count(); ++s) run(kernels_.forward_one, s);
  for (size_t k = 0; k < rows; ++k) y[k] *= inverse_[k];
  for (uint32_t s = nodes_.count(); s-- > 0;) run(kernels_.backward_one, s);
  for (uint32_t i = 0; i < n_; ++i)
    for (uint32_t c = 0; c < 3; ++c) x[3 * size_t{i} + c] = y[3 * size_t{nodes_.place[i]} + c];
}

void LdltSolver::solve_panel(uint32_t lanes, const double *b, double *x, double *panel) const {
  const size_t rows = 3 * size_t{n_};
  for (uint32_t i = 0; i < n_; ++i)
    for (uint32_t c = 0; c < 3; ++c) {
      double *const to = panel + (3 * size_t{nodes_.place[i]} + c) * kLanes;
      for (uint32_t r = 0; r < kLanes; ++r) to[r] = r < lanes ? b[r * rows + 3 * size_t{i} + c] : 0.0;
    }
  const auto run = [&](auto kernel, uint32_t s) {
    kernel(nodes_.width(s), nodes_.below(s), &value_[nodes_.value_begin[s]],
           nodes_.rows.data() + nodes_.row_begin[s], panel + 3 * size_t{nodes_.begin[s]} * kLanes, panel);
  };
  for (uint32_t s = 0; s < nodes_.count(); ++s) run(kernels_.forward, s);
  for (size_t k = 0; k < rows; ++k)
    for (uint32_t r = 0; r < kLanes; ++r) panel[k * kLanes + r] *= inverse_[k];
  for (uint32_t s = nodes_.count(); s-- > 0;) run(kernels_.backward, s);
  for (uint32_t i = 0; i < n_; ++i)
    for (uint32_t c = 0; c < 3; ++c) {
      const double *const from = panel + (3 * size_t{nodes_.place[i]} + c) * kLanes;
      for (uint32_t r = 0; r < lanes; ++r) x[r * rows + 3 * size_t{i} + c] = from[r];
    }
}

bool LdltSolver::solve(uint32_t nrhs, const double *b, double *x, double, SolveInfo &info) {
  info = {};
  if (!ready_) return false;
  const size_t rows = 3 * size_t{n_};
  if (nrhs == 1) {
    solve_one(b, x);
    return true;
  }
  const uint32_t npanel = (nrhs + kLanes - 1) / kLanes, together = std::min(npanel, slots());
  panels_.resize(std::max(panels_.size(), together * rows * kLanes));
  for (uint32_t first = 0; first < npanel; first += together)
    each_on(tasks_, std::min(together, npanel - first), 1, [&](size_t slot) {
      const size_t column = (first + slot) * kLanes;
      solve_panel(uint32_t(std::min<size_t>(kLanes, nrhs - column)), b + column * rows, x + column * rows,
                  panels_.data() + slot * rows * kLanes);
    });
  return true;
}

// Supernodes that the columns of a panel reach: their own and all ancestors (Gilbert and Peierls 1988).
void LdltSolver::find_reach() {
  reach_.clear();
  reach_begin_.assign(1, 0);
  reached_begin_.assign(1, 0);
  for (size_t c = 0; c < row_.size(); c += kLanes) {
    const uint32_t begin = reach_begin_.back();
    for (size_t k = c; k < c + kLanes && row_[k] != Supernodes::kNone; ++k)
      for (uint32_t s = nodes_.owner[row_[k] / 3]; s != Supernodes::kNone; s = nodes_.parent[s])
        reach_.push_back(s);
    std::sort(reach_.begin() + begin, reach_.end());
    reach_.erase(std::unique(reach_.begin() + begin, reach_.end()), reach_.end());
    size_t doubles = 0;
    for (uint32_t e = begin; e < reach_.size(); ++e) doubles += 3 * size_t{nodes_.width(reach_[e])} * kLanes;
    reach_begin_.push_back(uint32_t(reach_.size()));
    reached_begin_.push_back(reached_begin_.back() + doubles);
  }
  reached_.resize(reached_begin_.back());
}

void LdltSolver::forward_reached(uint32_t p, double *panel) {
  const auto rows = [&](uint32_t s) { return panel + 3 * size_t{nodes_.begin[s]} * kLanes; };
  const auto doubles = [&](uint32_t s) { return 3 * size_t{nodes_.width(s)} * kLanes; };
  for (uint32_t e = reach_begin_[p]; e < reach_begin_[p + 1]; ++e)
    std::fill(rows(reach_[e]), rows(reach_[e]) + doubles(reach_[e]), 0.0);
  for (size_t lane = 0; lane < kLanes; ++lane)
    if (const uint32_t row = row_[size_t{p} * kLanes + lane]; row != Supernodes::kNone)
      panel[size_t{row} * kLanes + lane] = 1.0;
  double *to = &reached_[reached_begin_[p]];
  for (uint32_t e = reach_begin_[p]; e < reach_begin_[p + 1]; ++e) {
    const uint32_t s = reach_[e];
    kernels_.forward(nodes_.width(s), nodes_.below(s), &value_[nodes_.value_begin[s]],
                     nodes_.rows.data() + nodes_.row_begin[s], rows(s), panel);
    const double *const from = rows(s), *const inverse = &inverse_[3 * size_t{nodes_.begin[s]}];
    for (size_t k = 0; k < 3 * size_t{nodes_.width(s)}; ++k) {
      const double root = std::sqrt(inverse[k]);
      for (size_t lane = 0; lane < kLanes; ++lane) *to++ = from[k * kLanes + lane] * root;
    }
  }
}

// sum[kLanes, kLanes] = Y_p^T Y_q over the rows that both panels reach
void LdltSolver::gram(uint32_t p, uint32_t q, double *sum) const {
  std::fill(sum, sum + kLanes * kLanes, 0.0);
  const double *left = &reached_[reached_begin_[p]], *right = &reached_[reached_begin_[q]];
  uint32_t a = reach_begin_[p], b = reach_begin_[q];
  const auto doubles = [&](uint32_t s) { return 3 * size_t{nodes_.width(s)} * kLanes; };
  while (a < reach_begin_[p + 1] && b < reach_begin_[q + 1]) {
    const uint32_t s = reach_[a], t = reach_[b];
    if (s == t) kernels_.gram(3 * nodes_.width(s), left, right, sum);
    if (s <= t) {
      left += doubles(s);
      ++a;
    }
    if (t <= s) {
      right += doubles(t);
      ++b;
    }
  }
}

// W = S P^T L^-T D^-1 L^-1 P S^T = Y^T Y with Y = D^-1/2 L^-1 P S^T: forward substitution is enough.
bool LdltSolver::restricted(uint32_t nsel, const uint32_t *sel, double *w) {
  if (!ready_) return false;
  order_.resize(nsel);
  std::iota(order_.begin(), order_.end(), 0u);
  std::sort(order_.begin(), order_.end(),
            [&](uint32_t a, uint32_t b) { return nodes_.place[sel[a]] < nodes_.place[sel[b]]; });
  const size_t rows = 3 * size_t{n_}, wide = 3 * size_t{nsel};
  const auto count = uint32_t((wide + kLanes - 1) / kLanes);
  row_.assign(size_t{count} * kLanes, Supernodes::kNone);
  for (size_t c = 0; c < wide; ++c) row_[c] = 3 * nodes_.place[sel[order_[c / 3]]] + uint32_t(c % 3);
  find_reach();
  const uint32_t together = std::min(count, slots());
  panels_.resize(std::max(panels_.size(), together * rows * kLanes));
  for (uint32_t p = 0; p < count; p += together)
    each_on(tasks_, std::min(together, count - p), 1,
            [&](size_t slot) { forward_reached(p + uint32_t(slot), panels_.data() + slot * rows * kLanes); });
  const auto place = [&](size_t c) { return 3 * size_t{order_[c / 3]} + c % 3; };
  each_on(tasks_, count, 1, [&](size_t p) {
    double sum[kLanes * kLanes];
    for (uint32_t q = 0; q <= p; ++q) {
      gram(uint32_t(p), q, sum);
      for (size_t r = p * kLanes; r < std::min(wide, (p + 1) * kLanes); ++r)
        for (size_t c = size_t{q} * kLanes; c < std::min(r + 1, size_t{q + 1} * kLanes); ++c)
          w[place(r) * wide + place(c)] = w[place(c) * wide + place(r)] =
              sum[(r % kLanes) * kLanes + c % kLanes];
    }
  });
  return true;
}

}  // namespace dfm
