#include "math/ldlt_solver.h"

#include <algorithm>
#include <limits>
#include <vector>

#include <Eigen/SparseCholesky>

namespace dfm {

namespace {

using Sparse = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;
// Points are ordered by us, so that the three components of a point stay together.
using Simplicial = Eigen::SimplicialLDLT<Sparse, Eigen::Upper, Eigen::NaturalOrdering<int>>;

// Pivots below this share of the diagonal are rounding: the matrix is singular as far as doubles tell.
constexpr double kPivot = 64 * std::numeric_limits<double>::epsilon();

}  // namespace

struct LdltSolver::Factor {
  Sparse upper;  // of the ordered matrix
  Simplicial ldlt;
  Eigen::VectorXd pivots;
  const Sparse &lower() const { return ldlt.matrixL().nestedExpression(); }  // strictly below the diagonal
};

LdltSolver::LdltSolver(const Memory &memory, Tasks *tasks) : tasks_(tasks) {
  use_memory(memory, place_, target_, selected_, first_);
  use_memory(memory, diagonal_, panels_);
}

LdltSolver::~LdltSolver() = default;

void LdltSolver::analyse(const BlockPattern &pattern) {
  ready_ = false;
  n_ = pattern.n;
  nb_ = pattern.nb;
  factor_ = std::make_unique<Factor>();
  using Triplet = Eigen::Triplet<double, int>;
  std::vector<Triplet> entries;
  entries.reserve(2 * size_t{nb_});
  for (uint32_t b = 0; b < nb_; ++b) {
    const int i = int(pattern.ij[2 * size_t{b}]), j = int(pattern.ij[2 * size_t{b} + 1]);
    entries.emplace_back(i, j, 1.0);
    if (i != j) entries.emplace_back(j, i, 1.0);
  }
  const int n = int(n_);
  Sparse points(n, n);
  points.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(points, order);  // order.indices()[k]: the point eliminated as the k-th
  place_.resize(n_);
  for (uint32_t k = 0; k < n_; ++k) place_[uint32_t(order.indices()[int(k)])] = k;

  entries.clear();
  entries.reserve(9 * size_t{nb_});
  const auto scatter = [&](auto &&f) {  // f(entry of blk, row, column) for what stands in the upper triangle
    for (uint32_t b = 0; b < nb_; ++b) {
      const uint32_t i = place_[pattern.ij[2 * size_t{b}]], j = place_[pattern.ij[2 * size_t{b} + 1]];
      for (uint32_t r = 0; r < 3; ++r)
        for (uint32_t c = 0; c < 3; ++c) {
          const uint32_t row = 3 * i + r, column = 3 * j + c;
          if (i != j || row <= column)
            f(9 * size_t{b} + 3 * r + c, std::min(row, column), std::max(row, column));
        }
    }
  };
  scatter([&](size_t, uint32_t row, uint32_t column) { entries.emplace_back(int(row), int(column), 1.0); });
  Sparse &upper = factor_->upper;
  upper.resize(int(3 * n_), int(3 * n_));
  upper.setFromTriplets(entries.begin(), entries.end());
  upper.makeCompressed();
  target_.assign(9 * size_t{nb_}, UINT32_MAX);
  scatter([&](size_t entry, uint32_t row, uint32_t column) {
    const int *const begin = upper.innerIndexPtr() + upper.outerIndexPtr()[column];
    const int *const end = upper.innerIndexPtr() + upper.outerIndexPtr()[column + 1];
    target_[entry] = uint32_t(std::lower_bound(begin, end, int(row)) - upper.innerIndexPtr());
  });
  factor_->ldlt.analyzePattern(upper);
  diagonal_.resize(3 * size_t{n_});
}

bool LdltSolver::factor(const double *blk) {
  ready_ = false;
  Sparse &upper = factor_->upper;
  for (size_t e = 0; e < target_.size(); ++e)
    if (target_[e] != UINT32_MAX) upper.valuePtr()[target_[e]] = blk[e];
  for (uint32_t k = 0; k < 3 * n_; ++k) diagonal_[k] = upper.valuePtr()[upper.outerIndexPtr()[k + 1] - 1];
  factor_->ldlt.factorize(upper);
  if (n_ && factor_->ldlt.info() != Eigen::Success) return false;
  factor_->pivots = factor_->ldlt.vectorD();
  const double *const d = factor_->pivots.data();
  for (uint32_t k = 0; k < 3 * n_; ++k)
    if (!(d[k] > kPivot * diagonal_[k]) || !(d[k] <= std::numeric_limits<double>::max())) return false;
  return ready_ = true;
}

void LdltSolver::forward(uint32_t first, double *panel) const {
  const Sparse &l = factor_->lower();
  const int *const outer = l.outerIndexPtr(), *const inner = l.innerIndexPtr();
  const double *const value = l.valuePtr();
  for (uint32_t k = first; k < 3 * n_; ++k) {
    double x[kPanel];
    bool zero = true;  // as above the first entry of a right-hand side, and beside what it reaches
    for (uint32_t r = 0; r < kPanel; ++r) {
      x[r] = panel[size_t{k} * kPanel + r];
      zero = zero && x[r] == 0;
    }
    if (zero) continue;
    for (int e = outer[k]; e < outer[k + 1]; ++e) {
      double *const y = panel + size_t(inner[e]) * kPanel;
      const double a = value[e];
      for (uint32_t r = 0; r < kPanel; ++r) y[r] -= a * x[r];
    }
  }
}

void LdltSolver::backward(double *panel) const {
  const Sparse &l = factor_->lower();
  const int *const outer = l.outerIndexPtr(), *const inner = l.innerIndexPtr();
  const double *const value = l.valuePtr();
  for (uint32_t k = 3 * n_; k-- > 0;) {
    double x[kPanel];
    for (uint32_t r = 0; r < kPanel; ++r) x[r] = panel[size_t{k} * kPanel + r];
    for (int e = outer[k]; e < outer[k + 1]; ++e) {
      const double *const y = panel + size_t(inner[e]) * kPanel;
      const double a = value[e];
      for (uint32_t r = 0; r < kPanel; ++r) x[r] -= a * y[r];
    }
    for (uint32_t r = 0; r < kPanel; ++r) panel[size_t{k} * kPanel + r] = x[r];
  }
}

template <class F>
void LdltSolver::each(uint32_t count, F &&f) const {
  if (!tasks_ || count < 2) {
    for (uint32_t k = 0; k < count; ++k) f(k);
    return;
  }
  tasks_->parallel_for(count, 1, [&](uint32_t begin, uint32_t end) {
    for (uint32_t k = begin; k < end; ++k) f(k);
  });
}

bool LdltSolver::solve(uint32_t nrhs, const double *b, double *x, double, SolveInfo &info) {
  info = {};
  if (!ready_) return false;
  const uint32_t npanel = (nrhs + kPanel - 1) / kPanel;
  const size_t rows = 3 * size_t{n_};
  panels_.resize(npanel * rows * kPanel);
  const auto one = [&](uint32_t p) {
    double *const panel = panels_.data() + p * rows * kPanel;
    const uint32_t lanes = std::min(kPanel, nrhs - p * kPanel);
    for (uint32_t i = 0; i < n_; ++i)
      for (uint32_t c = 0; c < 3; ++c) {
        double *const to = panel + (3 * size_t{place_[i]} + c) * kPanel;
        for (uint32_t r = 0; r < kPanel; ++r)
          to[r] = r < lanes ? b[(size_t{p} * kPanel + r) * rows + 3 * size_t{i} + c] : 0.0;
      }
    forward(0, panel);
    const double *const d = factor_->pivots.data();
    for (size_t k = 0; k < rows; ++k)
      for (uint32_t r = 0; r < kPanel; ++r) panel[k * kPanel + r] /= d[k];
    backward(panel);
    for (uint32_t i = 0; i < n_; ++i)
      for (uint32_t c = 0; c < 3; ++c) {
        const double *const from = panel + (3 * size_t{place_[i]} + c) * kPanel;
        for (uint32_t r = 0; r < lanes; ++r) x[(size_t{p} * kPanel + r) * rows + 3 * size_t{i} + c] = from[r];
      }
  };
  each(npanel, one);
  return true;
}

// W = S P^T L^-T D^-1 L^-1 P S^T = Y^T D^-1 Y with Y = L^-1 P S^T: the forward half is enough, and a column
// of Y begins at the row of its point.
bool LdltSolver::restricted(uint32_t nsel, const uint32_t *sel, double, double *w, SolveInfo &info) {
  info = {};
  if (!ready_) return false;
  const size_t rows = 3 * size_t{n_}, wide = 3 * size_t{nsel};
  selected_.resize(nsel);  // late points first in their panels
  for (uint32_t s = 0; s < nsel; ++s) selected_[s] = s;
  std::sort(selected_.begin(), selected_.end(),
            [&](uint32_t a, uint32_t b) { return place_[sel[a]] < place_[sel[b]]; });
  const uint32_t npanel = uint32_t((wide + kPanel - 1) / kPanel);
  panels_.assign(npanel * rows * kPanel, 0.0);
  first_.resize(npanel);
  each(npanel, [&](uint32_t p) {
    double *const panel = panels_.data() + p * rows * kPanel;
    for (size_t c = size_t{p} * kPanel; c < std::min(wide, (size_t{p} + 1) * kPanel); ++c)
      panel[(3 * size_t{place_[sel[selected_[c / 3]]]} + c % 3) * kPanel + c % kPanel] = 1.0;
    first_[p] = 3 * place_[sel[selected_[size_t{p} * kPanel / 3]]];
    forward(first_[p], panel);
  });
  const double *const d = factor_->pivots.data();
  each(npanel, [&](uint32_t p) {
    const double *const left = panels_.data() + p * rows * kPanel;
    for (uint32_t q = 0; q <= p; ++q) {
      const double *const right = panels_.data() + q * rows * kPanel;
      double sum[kPanel][kPanel] = {};
      for (size_t k = first_[p]; k < rows; ++k)
        for (uint32_t a = 0; a < kPanel; ++a) {
          const double y = left[k * kPanel + a] / d[k];
          for (uint32_t b = 0; b < kPanel; ++b) sum[a][b] += y * right[k * kPanel + b];
        }
      for (size_t a = 0; a < kPanel && p * kPanel + a < wide; ++a)
        for (size_t b = 0; b < kPanel && q * kPanel + b < wide; ++b) {
          const size_t i = p * kPanel + a, j = q * kPanel + b;
          if (j > i) continue;
          const size_t row = 3 * size_t{selected_[i / 3]} + i % 3,
                       column = 3 * size_t{selected_[j / 3]} + j % 3;
          w[row * wide + column] = w[column * wide + row] = sum[a][b];
        }
    }
  });
  return true;
}

}  // namespace dfm
