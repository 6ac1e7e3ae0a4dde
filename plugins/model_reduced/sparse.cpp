#include "sparse.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>

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
                    const std::vector<double> &blk, const double *places) {
  n_ = n;
  if (use_host_solver(host, ij, blk, places)) return;
  const std::vector<uint32_t> place = order_of(n, ij);
  Eigen::SimplicialLLT<Matrix, Eigen::Lower, Eigen::NaturalOrdering<int>> llt(
      lower_triangle(n, ij, blk, place));
  if (llt.info() != Eigen::Success) throw kIndefinite;
  const Matrix &l = llt.matrixL().nestedExpression();
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

}  // namespace reduced
