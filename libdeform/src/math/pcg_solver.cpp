#include "math/pcg_solver.h"

#include <algorithm>
#include <cmath>

namespace dfm {

namespace {

// Inverse of a symmetric 3x3 block; false where it is not positive definite.
bool invert(const double *a, double *out) {
  const double xx = a[4] * a[8] - a[5] * a[5], xy = a[2] * a[5] - a[1] * a[8], xz = a[1] * a[5] - a[2] * a[4];
  const double det = a[0] * xx + a[1] * xy + a[2] * xz;
  if (!(a[0] > 0) || !(a[0] * a[4] - a[1] * a[1] > 0) || !(det > 0)) return false;
  out[0] = xx / det;
  out[1] = out[3] = xy / det;
  out[2] = out[6] = xz / det;
  out[4] = (a[0] * a[8] - a[2] * a[2]) / det;
  out[5] = out[7] = (a[1] * a[2] - a[0] * a[5]) / det;
  out[8] = (a[0] * a[4] - a[1] * a[1]) / det;
  for (uint32_t k = 0; k < 9; ++k)
    if (!std::isfinite(out[k])) return false;
  return true;
}

double dot3(const double *a, const double *b) { return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]; }

}  // namespace

PcgSolver::PcgSolver(const Memory &memory, Tasks *tasks, uint32_t max_iterations)
    : tasks_(tasks), max_iterations_(max_iterations), a_(memory) {
  use_memory(memory, inverse_, r_, z_, p_, q_, partial_, unit_, answer_);
}

void PcgSolver::analyse(const BlockPattern &pattern) {
  ready_ = false;
  a_.set_pattern(pattern);
  const size_t rows = 3 * size_t{pattern.n};
  inverse_.assign(3 * rows, 0.0);
  for (Array<double> *v : {&r_, &z_, &p_, &q_}) v->assign(rows, 0.0);
  partial_.assign((pattern.n + BlockMatrix::kGrain - 1) / BlockMatrix::kGrain, 0.0);
}

bool PcgSolver::factor(const double *blk) {
  a_.set_values(blk);
  ready_ = true;
  for (uint32_t i = 0; i < a_.size() && ready_; ++i)
    ready_ = invert(a_.diagonal(i), &inverse_[9 * size_t{i}]);
  return ready_;
}

void PcgSolver::precondition(uint32_t begin, uint32_t end, const double *r, double *z) const {
  for (uint32_t i = begin; i < end; ++i) {
    const double *const m = &inverse_[9 * size_t{i}], *const p = r + 3 * size_t{i};
    for (uint32_t c = 0; c < 3; ++c) z[3 * size_t{i} + c] = dot3(m + 3 * c, p);
  }
}

template <class F>
double PcgSolver::sum(F &&f) {
  constexpr uint32_t kGrain = BlockMatrix::kGrain;
  const uint32_t n = a_.size();
  // A thread may be given several grains at once; each has its own partial sum all the same.
  const auto some = [&](uint32_t begin, uint32_t end) {
    for (uint32_t at = begin; at < end; at += kGrain)
      partial_[at / kGrain] = f(at, std::min(end, at + kGrain));
  };
  if (tasks_ && n > kGrain)
    tasks_->parallel_for(n, kGrain, [&](uint32_t begin, uint32_t end) { some(begin, end); });
  else some(0, n);
  double total = 0;
  for (const double part : partial_) total += part;
  return total;
}

bool PcgSolver::solve_one(const double *b, double *x, double tolerance, SolveInfo &info) {
  double *const r = r_.data(), *const z = z_.data(), *const p = p_.data(), *const q = q_.data();
  // The norm of x = 0 first: r.z with r = b.
  const double scale = sum([&](uint32_t begin, uint32_t end) {
    precondition(begin, end, b, z);
    double s = 0;
    for (uint32_t i = begin; i < end; ++i) s += dot3(b + 3 * size_t{i}, z + 3 * size_t{i});
    return s;
  });
  if (scale == 0) {
    std::fill(x, x + 3 * size_t{a_.size()}, 0.0);
    return true;
  }
  double rz = sum([&](uint32_t begin, uint32_t end) {
    a_.multiply(begin, end, x, q);
    for (size_t k = 3 * size_t{begin}; k < 3 * size_t{end}; ++k) r[k] = b[k] - q[k];
    precondition(begin, end, r, z);
    double s = 0;
    for (uint32_t i = begin; i < end; ++i) s += dot3(r + 3 * size_t{i}, z + 3 * size_t{i});
    return s;
  });
  const uint64_t limit = max_iterations_ ? max_iterations_ : 3 * uint64_t{a_.size()};
  const double goal = tolerance * tolerance * scale;
  std::copy(z_.begin(), z_.end(), p_.begin());
  uint64_t k = 0;
  for (; rz > goal && k < limit; ++k) {
    const double curvature = sum([&](uint32_t begin, uint32_t end) {
      a_.multiply(begin, end, p, q);
      double s = 0;
      for (uint32_t i = begin; i < end; ++i) s += dot3(p + 3 * size_t{i}, q + 3 * size_t{i});
      return s;
    });
    if (!(curvature > 0)) {  // not a number, too
      info.indefinite = true;
      break;
    }
    const double alpha = rz / curvature;
    const double next = sum([&](uint32_t begin, uint32_t end) {
      for (size_t e = 3 * size_t{begin}; e < 3 * size_t{end}; ++e) {
        x[e] += alpha * p[e];
        r[e] -= alpha * q[e];
      }
      precondition(begin, end, r, z);
      double s = 0;
      for (uint32_t i = begin; i < end; ++i) s += dot3(r + 3 * size_t{i}, z + 3 * size_t{i});
      return s;
    });
    const double beta = next / rz;
    rz = next;
    for (size_t e = 0; e < p_.size(); ++e) p[e] = z[e] + beta * p[e];
  }
  info.iterations += uint32_t(k);
  info.residual = std::max(info.residual, std::sqrt(std::max(rz, 0.0) / scale));
  return rz <= goal;
}

bool PcgSolver::solve(uint32_t nrhs, const double *b, double *x, double tolerance, SolveInfo &info) {
  info = {};
  if (!ready_) return false;
  const size_t rows = 3 * size_t{a_.size()};
  bool good = true;
  for (uint32_t k = 0; k < nrhs; ++k) good = solve_one(b + k * rows, x + k * rows, tolerance, info) && good;
  return good;
}

bool PcgSolver::restricted(uint32_t nsel, const uint32_t *sel, double tolerance, double *w, SolveInfo &info) {
  info = {};
  if (!ready_) return false;
  const size_t wide = 3 * size_t{nsel};
  unit_.assign(3 * size_t{a_.size()}, 0.0);
  answer_.resize(unit_.size());
  bool good = true;
  for (size_t c = 0; c < wide; ++c) {
    const size_t at = 3 * size_t{sel[c / 3]} + c % 3;
    unit_[at] = 1.0;
    std::fill(answer_.begin(), answer_.end(), 0.0);
    good = solve_one(unit_.data(), answer_.data(), tolerance, info) && good;
    unit_[at] = 0.0;
    for (size_t r = 0; r < wide; ++r) w[c * wide + r] = answer_[3 * size_t{sel[r / 3]} + r % 3];
  }
  for (size_t r = 0; r < wide; ++r)  // symmetric to the last bit, whatever the tolerance left
    for (size_t c = 0; c < r; ++c)
      w[r * wide + c] = w[c * wide + r] = 0.5 * (w[r * wide + c] + w[c * wide + r]);
  return good;
}

}  // namespace dfm
