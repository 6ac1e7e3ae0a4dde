// The tangent of a model's forces as a matrix, and differences to compare it with.
#pragma once
#include "dense.h"
#include "model_host.h"

namespace model_test {

using test::Dense;

inline std::vector<uint32_t> pattern_of(const ModelInstance &b) {
  uint32_t nb = 0;
  EXPECT_EQ(b.ops->pattern(b.self, &nb, nullptr), DFM_OK);
  std::vector<uint32_t> ij(2 * size_t(nb));
  EXPECT_EQ(b.ops->pattern(b.self, &nb, ij.data()), DFM_OK);
  return ij;
}

// a df/dx + b df/dv as one matrix. Implicit steps ask for it with negative factors.
inline Dense tangent(const ModelInstance &body, double a, double b) {
  const std::vector<uint32_t> ij = pattern_of(body);
  std::vector<double> blk(9 * (ij.size() / 2));
  const dfm_kin k = body.kin();
  EXPECT_EQ(body.ops->stiffness(body.self, &k, a, b, blk.data()), DFM_OK);
  std::vector<double> opposite(blk.size());
  EXPECT_EQ(body.ops->stiffness(body.self, &k, -a, -b, opposite.data()), DFM_OK);
  for (size_t n = 0; n < blk.size(); ++n)
    EXPECT_EQ(opposite[n], -blk[n]) << "of factors " << a << " and " << b;
  Dense out(3 * body.size(), 3 * body.size());
  for (size_t n = 0; n < ij.size() / 2; ++n)
    for (size_t r = 0; r < 3; ++r)
      for (size_t c = 0; c < 3; ++c) {
        const size_t row = 3 * ij[2 * n] + r, column = 3 * ij[2 * n + 1] + c;
        out(row, column) = out(column, row) = blk[9 * n + 3 * r + c];
      }
  return out;
}

// Differences of `forces(i)` (of point i, after `evaluate`) by each component of x or v.
template <class Evaluate, class Forces>
Dense differences(ModelInstance &b, double *of, double step, const Evaluate &evaluate, const Forces &forces) {
  const size_t n = 3 * b.size();
  Dense out(n, n);
  for (size_t c = 0; c < n; ++c) {
    double &at = of[4 * (c / 3) + c % 3];
    const double keep = at;
    for (double side : {1.0, -1.0}) {
      at = keep + side * step;
      evaluate();
      for (size_t r = 0; r < n; ++r) out(r, c) += side * forces(uint32_t(r / 3))[r % 3] / (2 * step);
    }
    at = keep;
  }
  return out;
}
inline Dense differences(ModelInstance &b, double *of, double step) {
  return differences(b, of, step, [&] { b.forces(); }, [&](uint32_t i) { return b.get(b.f, i); });
}

inline double largest(const Dense &m) {
  double most = 0;
  for (double x : m.value) most = std::max(most, std::abs(x));
  return most;
}
inline double largest_difference(const Dense &x, const Dense &y) {
  double most = 0;
  for (size_t n = 0; n < x.value.size(); ++n) most = std::max(most, std::abs(x.value[n] - y.value[n]));
  return most;
}

// Cholesky of shift I - m succeeds: no eigenvalue of m is above the shift.
inline bool below(const Dense &m, double shift) {
  Dense l(m.rows, m.rows);
  for (size_t r = 0; r < m.rows; ++r)
    for (size_t c = 0; c <= r; ++c) {
      double sum = (r == c ? shift : 0) - m(r, c);
      for (size_t k = 0; k < c; ++k) sum -= l(r, k) * l(c, k);
      if (r == c && !(sum > 0)) return false;
      l(r, c) = r == c ? std::sqrt(sum) : sum / l(c, c);
    }
  return true;
}

// Each point with itself and each edge of the mesh, once.
inline void expect_pattern_of_edges(const ModelInstance &b) {
  const std::vector<uint32_t> ij = pattern_of(b);
  std::set<std::pair<uint32_t, uint32_t>> expected, got;
  for (uint32_t i = 0; i < b.size(); ++i) expected.insert({i, i});
  for (size_t e = 0; e < b.mesh.edges.size(); e += 2) expected.insert({b.mesh.edges[e], b.mesh.edges[e + 1]});
  for (size_t n = 0; n < ij.size(); n += 2) {
    EXPECT_LE(ij[n], ij[n + 1]);
    got.insert({ij[n], ij[n + 1]});
  }
  EXPECT_EQ(got, expected);
  EXPECT_EQ(ij.size() / 2, expected.size());
}

}  // namespace model_test
