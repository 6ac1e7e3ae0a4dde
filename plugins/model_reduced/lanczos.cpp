// The largest eigenpairs by Lanczos's method on blocks of kLanes vectors (Golub and Underwood 1977): as many
// right-hand sides go through the factor for the price of two or three, and the copies of a multiple
// eigenvalue are found together. All vectors are kept and orthogonalized against each other, so there is no
// restart and no eigenpair is found twice.
#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>

#include "sparse.h"

namespace reduced {
namespace {

// Below this share of the largest value a pair is one of C's kernel. Relative residual required.
constexpr double kKernel = 1e-13, kAccuracy = 1e-13;
constexpr const char *kFlat = "the modes of the mesh were not found: its cells are too flat";
constexpr double kNothing = 1e-10;  // of a vector that was left beside those before
constexpr size_t kLook = 3;         // blocks between two looks at what has converged

double random(uint64_t &state) {
  state = state * 6364136223846793005u + 1442695040888963407u;
  return double(int64_t(state) >> 11) * 0x1p-52;
}

// Eigenpairs of a matrix, values falling, vectors in the columns; none of its kernel.
struct Largest {
  Eigen::VectorXd value;
  Eigen::MatrixXd vector;
};

// z = (T - shift)^-1 z, T tridiagonal with `beside` its diagonal: elimination with exchange of rows. A pivot
// of less than `least` is that.
void solve_shifted(const Eigen::VectorXd &diagonal, const Eigen::VectorXd &beside, double shift, double least,
                   Eigen::VectorXd &z) {
  const Eigen::Index n = diagonal.size();
  std::vector<std::array<double, 3>> upper;
  const auto keep = [&](std::array<double, 3> row) {
    if (!(std::fabs(row[0]) > least)) row[0] = least;
    upper.push_back(row);
    return row;
  };
  std::array<double, 3> row{diagonal[0] - shift, n > 1 ? beside[0] : 0, 0};
  for (Eigen::Index i = 0; i + 1 < n; ++i) {
    std::array<double, 3> next{beside[i], diagonal[i + 1] - shift, i + 2 < n ? beside[i + 1] : 0};
    if (std::fabs(next[0]) > std::fabs(row[0])) {
      std::swap(row, next);
      std::swap(z[i], z[i + 1]);
    }
    row = keep(row);
    const double part = next[0] / row[0];
    z[i + 1] -= part * z[i];
    row = {next[1] - part * row[1], next[2] - part * row[2], 0};
  }
  keep(row);
  for (Eigen::Index i = n; i-- > 0;) {
    const auto &u = upper[size_t(i)];
    if (i + 1 < n) z[i] -= u[1] * z[i + 1];
    if (i + 2 < n) z[i] -= u[2] * z[i + 2];
    z[i] /= u[0];
  }
}

// Of the symmetric a: by its tridiagonal form, the vectors by inverse iteration, each beside those before it,
// so that copies of a multiple value have their own. Values take n^2 operations and vectors a few n, where
// all vectors together would take several times as long as the form.
Largest largest_of(const Eigen::MatrixXd &a, size_t count) {
  const Eigen::Tridiagonalization<Eigen::MatrixXd> form(a);
  const Eigen::VectorXd diagonal = form.diagonal(), beside = form.subDiagonal();
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(diagonal, beside, Eigen::EigenvaluesOnly);
  if (solver.info() != Eigen::Success) throw kFlat;
  const Eigen::VectorXd values = solver.eigenvalues().reverse();
  const Eigen::Index n = values.size();
  Eigen::Index m = 0;
  while (m < std::min(Eigen::Index(count), n) && values[m] > kKernel * values[0]) ++m;
  Largest out{values.head(m), Eigen::MatrixXd(n, m)};
  uint64_t state = 0x9e3779b97f4a7c15u;
  Eigen::VectorXd z(n);
  for (Eigen::Index k = 0; k < m; ++k) {
    for (double &each : z) each = random(state);
    for (int round = 0; round < 4; ++round) {
      solve_shifted(diagonal, beside, values[k], 1e-16 * values[0], z);
      z.normalize();
      for (int twice = 0; twice < 2; ++twice)
        z -= out.vector.leftCols(k) * (out.vector.leftCols(k).transpose() * z);
      z.normalize();
    }
    out.vector.col(k) = z;
  }
  out.vector.applyOnTheLeft(form.matrixQ());
  return out;
}

class Krylov {
 public:
  Krylov(const Kernels &kernels, size_t size, const Apply &c) : kernels_(kernels), size_(size), c_(c) {
    std::vector<double> x(kLanes * size);
    for (double &a : x) a = random(state_);
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
  // The pairs of the block before the last, values falling; how far they are from true ones is what goes over
  // to the last block.
  bool converged(size_t count) {
    const Eigen::Index m = Eigen::Index(width() - kLanes);
    if (m < Eigen::Index(count)) return false;
    const Eigen::MatrixXd t = t_.topLeftCorner(m, m).selfadjointView<Eigen::Upper>();
    largest_ = largest_of(t, count);
    const Eigen::MatrixXd over = r_ * largest_.vector.bottomRows(kLanes);
    for (Eigen::Index k = 0; k < over.cols(); ++k)
      if (!(over.col(k).norm() <= kAccuracy * largest_.value[k])) return false;
    return true;
  }
  Pairs pairs() const {
    Pairs out;
    const Eigen::Index m = largest_.vector.rows();
    for (Eigen::Index k = 0; k < largest_.value.size(); ++k) {
      const auto part = largest_.vector.col(k);
      std::vector<double> x(size_);
      for (size_t b = 0; b < size_t(m); b += kLanes)
        for (size_t i = 0; i < size_; ++i)
          for (size_t l = 0; l < kLanes; ++l)
            x[i] += v_[b * size_ + kLanes * i + l] * part[Eigen::Index(b + l)];
      out.value.push_back(largest_.value[k]);
      out.vector.push_back(std::move(x));
    }
    return out;
  }
  size_t width() const { return v_.size() / size_; }

 private:
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
  Largest largest_;
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
  const Largest largest = largest_of(0.5 * (full + full.transpose()), count);
  Pairs out;
  out.value.assign(largest.value.begin(), largest.value.end());
  for (const auto &column : largest.vector.colwise()) out.vector.emplace_back(column.begin(), column.end());
  return out;
}

}  // namespace

Pairs largest_pairs(const Kernels &kernels, size_t size, const Apply &c, size_t count) {
  if (size <= 600 || 4 * count + 20 >= size) return all_pairs(size, c, count);
  Krylov space(kernels, size, c);
  for (size_t block = 1; space.width() + 2 * kLanes < size; ++block) {
    space.grow();
    if (block % kLook == 0 && space.converged(count)) return space.pairs();
  }
  throw "the modes of the mesh were not found: its cells are too flat, or fewer modes are needed";
}

}  // namespace reduced
