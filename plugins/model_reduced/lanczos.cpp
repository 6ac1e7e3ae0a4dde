// The largest eigenpairs by Lanczos's method on blocks of kLanes vectors (Golub and Underwood 1977): as many
// right-hand sides go through the factor for the price of two or three, and the copies of a multiple
// eigenvalue are found together. All vectors are kept and orthogonalized against each other, so there is no
// restart and no eigenpair is found twice.
#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

#include "sparse.h"

namespace reduced {
namespace {

// Below this share of the largest value a pair is one of C's kernel. Relative residual required.
constexpr double kKernel = 1e-13, kAccuracy = 1e-13;
constexpr double kNothing = 1e-10;  // of a vector that was left beside those before
constexpr size_t kLook = 3;         // blocks between two looks at what has converged

class Krylov {
 public:
  Krylov(const Kernels &kernels, size_t size, const Apply &c) : kernels_(kernels), size_(size), c_(c) {
    std::vector<double> x(kLanes * size);
    for (double &a : x) a = random();
    begin_block();
    c_(x.data(), last());
    orthonormalize();
  }
  // Another block: C times the last one, beside all before.
  void grow() {
    const size_t from = width() - kLanes, block = kLanes * size_;
    const std::vector<double> x(last(), last() + block);
    begin_block();
    c_(x.data(), last());
    widen(width());
    for (int twice = 0; twice < 2; ++twice)
      for (size_t b = 0; b < from + kLanes; b += kLanes) {
        double h[kLanes * kLanes] = {};
        kernels_.gram(size_, v_.data() + b * size_, last(), h);
        kernels_.take_off(size_, v_.data() + b * size_, h, last());
        for (size_t i = 0; i < kLanes; ++i)
          for (size_t j = 0; j < kLanes; ++j)
            t_(Eigen::Index(b + i), Eigen::Index(from + j)) += h[kLanes * i + j];
      }
    orthonormalize();
  }
  // The pairs of the block before the last: values rising; how far they are from true ones is what goes over
  // to the last block.
  bool converged(size_t count) {
    const Eigen::Index m = Eigen::Index(width() - kLanes);
    if (m < Eigen::Index(count)) return false;
    const Eigen::MatrixXd t = t_.topLeftCorner(m, m).selfadjointView<Eigen::Upper>();
    solver_.compute(t);
    if (solver_.info() != Eigen::Success) return false;
    for (size_t k = 0; k < count; ++k) {
      const Eigen::VectorXd over = r_ * solver_.eigenvectors().col(m - 1 - Eigen::Index(k)).tail(kLanes);
      const double value = solver_.eigenvalues()[m - 1 - Eigen::Index(k)];
      if (value > kKernel * solver_.eigenvalues()[m - 1] && !(over.norm() <= kAccuracy * value)) return false;
    }
    return true;
  }
  Pairs pairs(size_t count) const {
    Pairs out;
    const Eigen::Index m = solver_.eigenvalues().size();
    for (size_t k = 0; k < count; ++k) {
      const double value = solver_.eigenvalues()[m - 1 - Eigen::Index(k)];
      if (!(value > kKernel * solver_.eigenvalues()[m - 1])) break;
      const auto part = solver_.eigenvectors().col(m - 1 - Eigen::Index(k));
      std::vector<double> x(size_);
      for (size_t b = 0; b < size_t(m); b += kLanes)
        for (size_t i = 0; i < size_; ++i)
          for (size_t l = 0; l < kLanes; ++l)
            x[i] += v_[b * size_ + kLanes * i + l] * part[Eigen::Index(b + l)];
      out.value.push_back(value);
      out.vector.push_back(std::move(x));
    }
    return out;
  }
  size_t width() const { return v_.size() / size_; }

 private:
  double random() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return double(int64_t(state_) >> 11) * 0x1p-52;
  }
  double *last() { return v_.data() + v_.size() - kLanes * size_; }
  void begin_block() { v_.resize(v_.size() + kLanes * size_); }
  void widen(size_t width) {
    const Eigen::Index before = t_.rows(), now = Eigen::Index(width);
    t_.conservativeResize(now, now);
    t_.rightCols(now - before).setZero();
    t_.bottomRows(now - before).setZero();
  }
  double dot(size_t i, size_t j) {
    const double *const u = last();
    double sum = 0;
    for (size_t n = 0; n < kLanes * size_; n += kLanes) sum += u[n + i] * u[n + j];
    return sum;
  }
  // The last block's columns by Gram and Schmidt's method, twice; r_ is what they were made of. A column of
  // which nothing is left becomes zero: a pair of C's kernel, which is not counted.
  void orthonormalize() {
    double *const u = last();
    r_.setZero(kLanes, kLanes);
    for (size_t j = 0; j < kLanes; ++j) {
      const double before = std::sqrt(dot(j, j));
      for (int twice = 0; twice < 2; ++twice)
        for (size_t i = 0; i < j; ++i) {
          const double along = dot(i, j);
          r_(Eigen::Index(i), Eigen::Index(j)) += along;
          for (size_t n = 0; n < kLanes * size_; n += kLanes) u[n + j] -= along * u[n + i];
        }
      const double length = std::sqrt(dot(j, j));
      const bool lost = !(length > kNothing * before) || !(length > 0);
      r_(Eigen::Index(j), Eigen::Index(j)) = lost ? 0 : length;
      for (size_t n = 0; n < kLanes * size_; n += kLanes) u[n + j] = lost ? 0 : u[n + j] / length;
    }
  }

  const Kernels &kernels_;
  const size_t size_;
  const Apply &c_;
  uint64_t state_ = 0x9e3779b97f4a7c15u;
  std::vector<double> v_;  // blocks [size, kLanes], columns orthonormal or zero
  Eigen::MatrixXd t_, r_;  // V^T C V; [kLanes,kLanes]
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver_;
};

Pairs all_pairs(size_t size, const Apply &c, size_t count) {
  Eigen::MatrixXd full(size, size);
  std::vector<double> unit(kLanes * size), response(kLanes * size);
  for (size_t k = 0; k < size; k += kLanes) {
    const size_t many = std::min(kLanes, size - k);
    for (size_t l = 0; l < many; ++l) unit[kLanes * (k + l) + l] = 1;
    c(unit.data(), response.data());
    for (size_t l = 0; l < many; ++l) {
      unit[kLanes * (k + l) + l] = 0;
      for (size_t i = 0; i < size; ++i) full(Eigen::Index(i), Eigen::Index(k + l)) = response[kLanes * i + l];
    }
  }
  const Eigen::MatrixXd symmetric = 0.5 * (full + full.transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  if (solver.info() != Eigen::Success) throw "the modes of the mesh were not found: its cells are too flat";
  Pairs out;
  const Eigen::Index last = Eigen::Index(size) - 1;
  for (size_t k = 0; k < std::min(count, size); ++k) {
    const double value = solver.eigenvalues()[last - Eigen::Index(k)];
    if (!(value > kKernel * solver.eigenvalues()[last])) break;
    const auto column = solver.eigenvectors().col(last - Eigen::Index(k));
    out.value.push_back(value);
    out.vector.emplace_back(column.data(), column.data() + size);
  }
  return out;
}

}  // namespace

Pairs largest_pairs(const Kernels &kernels, size_t size, const Apply &c, size_t count) {
  if (size <= 600 || 4 * count + 20 >= size) return all_pairs(size, c, count);
  Krylov space(kernels, size, c);
  for (size_t block = 1; space.width() + 2 * kLanes < size; ++block) {
    space.grow();
    if (block % kLook == 0 && space.converged(count)) return space.pairs(count);
  }
  throw "the modes of the mesh were not found: its cells are too flat, or fewer modes are needed";
}

}  // namespace reduced
