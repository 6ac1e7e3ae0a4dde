#include "sparse.h"

#include <Eigen/Dense>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <Spectra/SymEigsSolver.h>

#include <algorithm>
#include <cmath>

namespace reduced {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

// Approximate minimum degree (Amestoy, Davis and Duff 1996) on the graph of the points, so that the three
// components of a point stay together. place[i]: of point i in the order.
std::vector<uint32_t> order_of(uint32_t n, const std::vector<uint32_t> &ij) {
  std::vector<Eigen::Triplet<double>> graph;
  graph.reserve(ij.size());
  for (size_t b = 0; b < ij.size(); b += 2) {
    graph.emplace_back(int(ij[b]), int(ij[b + 1]), 1.0);
    if (ij[b] != ij[b + 1]) graph.emplace_back(int(ij[b + 1]), int(ij[b]), 1.0);
  }
  Matrix g(n, n);
  g.setFromTriplets(graph.begin(), graph.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> kth;
  Eigen::AMDOrdering<int>()(g, kth);
  std::vector<uint32_t> place(n);
  for (uint32_t k = 0; k < n; ++k) place[size_t(kth.indices()[k])] = k;
  return place;
}

// The lower triangle in that order.
Matrix lower_triangle(uint32_t n, const std::vector<uint32_t> &ij, const std::vector<double> &blk,
                      const std::vector<uint32_t> &place) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(blk.size());
  for (size_t b = 0; 2 * b < ij.size(); ++b) {
    const int i = int(3 * place[ij[2 * b]]), j = int(3 * place[ij[2 * b + 1]]);
    for (int r = 0; r < 3; ++r)
      for (int s = 0; s < 3; ++s) {
        const double value = blk[9 * b + size_t(3 * r + s)];
        if (i == j && s <= r) entries.emplace_back(i + r, j + s, value);
        else if (i != j) entries.emplace_back(std::max(i + r, j + s), std::min(i + r, j + s), value);
      }
  }
  Matrix a(3 * n, 3 * n);
  a.setFromTriplets(entries.begin(), entries.end());
  return a;
}

}  // namespace

void Factor::create(const dfm_host *host, uint32_t n, const std::vector<uint32_t> &ij,
                    const std::vector<double> &blk) {
  const std::vector<uint32_t> place = order_of(n, ij);
  Eigen::SimplicialLLT<Matrix, Eigen::Lower, Eigen::NaturalOrdering<int>> llt(
      lower_triangle(n, ij, blk, place));
  if (llt.info() != Eigen::Success)
    throw "the stiffness of the mesh is not positive definite: it has flat cells, or parts that hang on "
          "nothing";
  const Matrix &l = llt.matrixL().nestedExpression();
  n_ = n;
  place_.create(host, n);
  std::copy(place.begin(), place.end(), place_.data());
  begin_.create(host, size_t(n) + 1);
  ordered_.create(host, 3 * kLanes * n);
  // The three columns of a point have the same points below, up to entries that the elimination did not see.
  std::vector<uint32_t> rows;
  std::vector<std::vector<uint32_t>> below(n);
  for (uint32_t j = 0; j < n; ++j) {
    rows.clear();
    rows.push_back(j);
    for (uint32_t k = 0; k < 3; ++k)
      for (Matrix::InnerIterator it(l, Eigen::Index(3 * j + k)); it; ++it)
        rows.push_back(uint32_t(it.row()) / 3);
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    below[j] = rows;
    begin_[j + 1] = begin_[j] + uint32_t(rows.size());
  }
  row_.create(host, begin_[n]);
  block_.create(host, 9 * size_t(begin_[n]));
  for (uint32_t j = 0; j < n; ++j) {
    std::copy(below[j].begin(), below[j].end(), row_.data() + begin_[j]);
    for (uint32_t k = 0; k < 3; ++k) {
      size_t at = 0;
      for (Matrix::InnerIterator it(l, Eigen::Index(3 * j + k)); it; ++it) {
        const uint32_t row = uint32_t(it.row());
        while (below[j][at] != row / 3) ++at;
        block_[9 * (begin_[j] + at) + 3 * (row % 3) + k] = it.value();
      }
    }
  }
}

namespace {

// C without what it does along the vectors found so far.
struct Deflated {
  using Scalar = double;
  size_t size;
  const Apply &c;
  const Pairs &found;
  mutable std::vector<double> in;  // Spectra asks a const operator

  Eigen::Index rows() const { return Eigen::Index(size); }
  Eigen::Index cols() const { return rows(); }
  void remove(double *y) const {
    for (const std::vector<double> &w : found.vector) {
      double along = 0;
      for (size_t i = 0; i < size; ++i) along += w[i] * y[i];
      for (size_t i = 0; i < size; ++i) y[i] -= along * w[i];
    }
  }
  void perform_op(const double *x, double *y) const {
    in.assign(x, x + size);
    remove(in.data());
    c(in.data(), y);
    remove(y);
  }
};

// Below this share of the largest value a pair is one of C's kernel. Relative residual asked of Lanczos.
constexpr double kKernel = 1e-13, kAccuracy = 1e-13;

void keep(Pairs &pairs, const Eigen::VectorXd &values, const Eigen::MatrixXd &vectors, size_t count) {
  for (Eigen::Index k = 0; k < values.size() && pairs.value.size() < count; ++k) {
    const double largest = pairs.value.empty() ? values[0] : pairs.value[0];
    if (!(values[k] > kKernel * largest)) return;
    pairs.value.push_back(values[k]);
    pairs.vector.emplace_back(vectors.col(k).data(), vectors.col(k).data() + vectors.rows());
  }
}

Pairs all_pairs(size_t size, const Apply &c, size_t count) {
  Eigen::MatrixXd full(size, size);
  Eigen::VectorXd unit = Eigen::VectorXd::Zero(Eigen::Index(size));
  for (Eigen::Index k = 0; k < Eigen::Index(size); ++k) {
    unit[k] = 1;
    c(unit.data(), full.col(k).data());
    unit[k] = 0;
  }
  const Eigen::MatrixXd symmetric = 0.5 * (full + full.transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  if (solver.info() != Eigen::Success) throw "the modes of the mesh were not found: its cells are too flat";
  const Eigen::VectorXd values = solver.eigenvalues().reverse();
  const Eigen::MatrixXd vectors = solver.eigenvectors().rowwise().reverse();
  Pairs out;
  keep(out, values, vectors, count);
  return out;
}

Pairs lanczos(Deflated &op, size_t count) {
  const auto nev = Eigen::Index(count), ncv = Eigen::Index(std::min(op.size, 2 * count + 20));
  Spectra::SymEigsSolver<Deflated> solver(op, nev, ncv);
  solver.init();
  const Eigen::Index got = solver.compute(Spectra::SortRule::LargestMagn, 1000, kAccuracy);
  if (solver.info() != Spectra::CompInfo::Successful || got < nev)
    throw "the modes of the mesh were not found: its cells are too flat, or fewer modes are needed";
  Pairs out;
  keep(out, solver.eigenvalues(), solver.eigenvectors(), count);
  return out;
}

}  // namespace

// Lanczos's method sees one vector of an eigenspace, and its copies by rounding alone. So it is asked again
// for what is left beside the pairs found: where that has a value above the least of them, a copy lacked.
Pairs largest_pairs(size_t size, const Apply &c, size_t count) {
  if (size <= 600 || 4 * count + 20 >= size) return all_pairs(size, c, count);
  Pairs pairs;
  Deflated op{size, c, pairs, {}};
  pairs = lanczos(op, count);
  constexpr size_t kAgain = 2;
  for (int round = 0; round < 20 && pairs.value.size() == count; ++round) {
    const Pairs more = lanczos(op, kAgain);
    const double least = pairs.value.back();
    if (more.value.empty() || !(more.value[0] > least)) return pairs;
    for (size_t k = 0; k < more.value.size(); ++k) {
      const auto at = std::upper_bound(pairs.value.begin(), pairs.value.end(), more.value[k],
                                       [](double a, double b) { return a > b; }) -
                      pairs.value.begin();
      pairs.value.insert(pairs.value.begin() + at, more.value[k]);
      pairs.vector.insert(pairs.vector.begin() + at, more.vector[k]);
    }
    pairs.value.resize(count);
    pairs.vector.resize(count);
  }
  return pairs;
}

}  // namespace reduced
