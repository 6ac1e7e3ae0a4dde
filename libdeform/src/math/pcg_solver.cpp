#include "math/pcg_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "math/vec3.h"
#include "math/width.h"

namespace dfm {

namespace {

// Inverse of a symmetric 3x3 block by L D L^T, accurate where the block is almost singular; false where it is
// not positive definite.
bool invert(const double *a, double *out) {
  if (!(a[0] > 0)) return false;
  const double l10 = a[1] / a[0], l20 = a[2] / a[0], d1 = a[4] - l10 * a[1];
  if (!(d1 > 0)) return false;
  const double l21 = (a[5] - l10 * a[2]) / d1, d2 = a[8] - l20 * a[2] - l21 * (a[5] - l10 * a[2]);
  if (!(d2 > 0)) return false;
  const double m20 = l10 * l21 - l20;
  out[0] = 1 / a[0] + l10 * l10 / d1 + m20 * m20 / d2;
  out[1] = out[3] = -l10 / d1 - m20 * l21 / d2;
  out[2] = out[6] = m20 / d2;
  out[4] = 1 / d1 + l21 * l21 / d2;
  out[5] = out[7] = -l21 / d2;
  out[8] = 1 / d2;
  return all_finite(out, 9);
}

constexpr uint32_t kOneLevel = 200;  // below this number of points one level alone is faster

}  // namespace

PcgSolver::PcgSolver(const Memory &memory, Tasks *tasks, uint32_t max_iterations, bool motions)
    : kernels_(block_kernels()),
      tasks_(tasks),
      max_iterations_(max_iterations),
      a_(memory),
      coarse_(memory, tasks, motions) {
  use_memory(memory, inverse_, r_, z_, p_, q_, partial_, other_);
}

void PcgSolver::analyse(const BlockPattern &pattern) {
  ready_ = patched_ = with_coarse_ = false;
  points_ = nullptr;
  a_.set_pattern(pattern);
  const size_t rows = 3 * size_t{pattern.n};
  inverse_.assign(3 * rows + 1, 0.0);  // one more: the load of the last column reads it
  for (Array<double> *v : {&r_, &z_, &p_, &q_}) v->assign(rows, 0.0);
  partial_.assign((pattern.n + BlockMatrix::kGrain - 1) / BlockMatrix::kGrain, 0.0);
  other_ = partial_;
}

void PcgSolver::place(const double *points, uint32_t stride) {
  points_ = points;
  stride_ = stride;
}

bool PcgSolver::factor(const double *blk) {
  const double *const points = std::exchange(points_, nullptr);
  ready_ = with_coarse_ = false;  // also if there is not enough memory
  a_.set_values(tasks_, blk);
  const double bad = sum([&](uint32_t begin, uint32_t end) {
    bool good = true;
    for (uint32_t i = begin; i < end; ++i) good = invert(a_.diagonal(i), &inverse_[9 * size_t{i}]) && good;
    return good ? 0.0 : 1.0;
  });
  if (bad > 0) return false;
  if (points && a_.size() >= kOneLevel) {
    if (!patched_) coarse_.analyse(a_.rows(), a_.size());
    patched_ = true;
    with_coarse_ = coarse_.factor(a_.rows(), points, stride_);
  }
  return ready_ = true;
}

// Calls f(begin, end) for each grain of points, however the work is divided among threads.
template <class F>
void PcgSolver::each(F &&f) {
  constexpr uint32_t kGrain = BlockMatrix::kGrain;
  const uint32_t n = a_.size();
  const auto grains = [&](uint32_t begin, uint32_t end) {
    for (uint32_t at = begin; at < end; at += kGrain) f(at, std::min(end, at + kGrain));
  };
  if (tasks_ && n > BlockMatrix::kAlone)
    tasks_->parallel_for(n, kGrain, [&](uint32_t begin, uint32_t end) { grains(begin, end); });
  else grains(0, n);
}

// The sum of the values that f returns, added grain by grain in order.
template <class F>
double PcgSolver::sum(F &&f) {
  each([&](uint32_t begin, uint32_t end) { partial_[begin / BlockMatrix::kGrain] = f(begin, end); });
  double total = 0;
  for (const double part : partial_) total += part;
  return total;
}

// z = M^-1 r, where before(begin, end) makes r first; returns r.z, and sets z_q_ to z.q if there is a
// coarse level
template <class F>
double PcgSolver::precondition(F &&before) {
  const double *const r = r_.data(), *const q = q_.data();
  double *const z = z_.data();
  if (!with_coarse_)
    return sum([&](uint32_t begin, uint32_t end) {
      before(begin, end);
      return kernels_.diagonal(inverse_.data(), begin, end, r, z);
    });
  each(before);
  const double coarse = coarse_.solve(r);
  const double fine = sum([&](uint32_t begin, uint32_t end) {
    const double dot = kernels_.diagonal(inverse_.data(), begin, end, r, z);
    other_[begin / BlockMatrix::kGrain] = coarse_.add(begin, end, q, z);
    return dot;
  });
  z_q_ = 0;
  for (const double part : other_) z_q_ += part;
  return fine + coarse;
}

bool PcgSolver::solve_one(const double *b, double *x, double tolerance, SolveInfo &info) {
  double *const r = r_.data(), *const p = p_.data(), *const q = q_.data();
  const size_t rows = 3 * size_t{a_.size()};
  std::copy_n(b, rows, r);
  const double scale = precondition([](uint32_t, uint32_t) {});  // of x = 0
  if (scale == 0) {
    std::fill(x, x + rows, 0.0);
    return true;
  }
  double rz = scale;
  if (std::any_of(x, x + rows, [](double v) { return v != 0; }))
    rz = precondition([&](uint32_t begin, uint32_t end) {
      a_.multiply(begin, end, x, q);
      for (size_t k = 3 * size_t{begin}; k < 3 * size_t{end}; ++k) r[k] = b[k] - q[k];
    });
  const uint64_t limit = max_iterations_ ? max_iterations_ : 3 * uint64_t{a_.size()};
  const double goal = tolerance * tolerance * scale;
  double beta = 0;
  std::fill(p_.begin(), p_.end(), 0.0);
  uint64_t k = 0;
  for (; rz > goal && k < limit; ++k) {
    each([&](uint32_t begin, uint32_t end) { kernels_.turn(begin, end, beta, z_.data(), p); });
    const double curvature = sum([&](uint32_t begin, uint32_t end) { return a_.multiply(begin, end, p, q); });
    if (!(curvature > 0)) {  // not a number, too
      info.indefinite = true;
      break;
    }
    const double alpha = rz / curvature;
    const double next =
        precondition([&](uint32_t begin, uint32_t end) { kernels_.advance(begin, end, alpha, p, q, x, r); });
    // A level that is not solved exactly is not the same linear map each time: this beta keeps the
    // directions conjugate (flexible conjugate gradients, Notay 2000; the change of r is -alpha q).
    beta = with_coarse_ ? -z_q_ / curvature : next / rz;
    rz = next;
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

}  // namespace dfm
