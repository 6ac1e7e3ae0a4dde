// Blocks of the tangent: the pattern, the usual one against R K R^T, the exact one against differences of the
// forces over decades where nothing is left out, and that the sum is negative semidefinite in every shape.
#include "../../plugins/model_common/rotation.h"
#include "corot_host.h"
#include "model_tangent.h"

namespace corot_test {
namespace {

const Params kFibers = {
    {"anisotropy_young", {1e6}}, {"anisotropy_shear", {1e5}}, {"anisotropy_axis", {1, 2, -0.5}}};
Params with(Params p, const char *key, double value) {
  p[key] = {value};
  return p;
}
Params exact(const Params &p = {}) { return with(p, "tangent", 1); }

// Every cell longer than at rest in every direction, and turned.
void stretch(Instance &b, double by) {
  const Vec about = (1 / std::sqrt(14.0)) * Vec{-1, 3, 2};
  for (uint32_t i = 0; i < b.size(); ++i) {
    const Vec x = b.mesh.at(i);
    b.set(b.x, i, rotate({by * x[0] + 0.1 * x[1], (by + 0.1) * x[1], (by - 0.05) * x[2]}, about, 0.8));
  }
}

const Params kNodal = {{"locking", {1}}, {"poisson", {0.45}}};

// The volume change of a point joins all points around it.
TEST(CorotStiffness, NodalPattern_IsAllPairsOfPointsWithACommonNeighbor) {
  Host host;
  Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2), kNodal);
  std::vector<std::set<uint32_t>> around(b.size());
  for (uint32_t i = 0; i < b.size(); ++i) around[i].insert(i);
  for (size_t e = 0; e < b.mesh.edges.size(); e += 2) {
    around[b.mesh.edges[e]].insert(b.mesh.edges[e + 1]);
    around[b.mesh.edges[e + 1]].insert(b.mesh.edges[e]);
  }
  std::set<std::pair<uint32_t, uint32_t>> expected, got;
  for (const auto &points : around)
    for (const uint32_t i : points)
      for (const uint32_t j : points) expected.insert(std::minmax(i, j));
  const std::vector<uint32_t> ij = pattern_of(b);
  for (size_t n = 0; n < ij.size(); n += 2) {
    EXPECT_LE(ij[n], ij[n + 1]);
    got.insert({ij[n], ij[n + 1]});
  }
  EXPECT_EQ(got, expected);
  EXPECT_EQ(ij.size() / 2, expected.size());
}

TEST(CorotStiffness, Pattern_IsEachPointAndEachEdgeOnce) {
  Host host;
  Instance b(host, kuhn_bar(3, 2, 2, 0.1, 0.2));
  expect_pattern_of_edges(b);
}

// At rest and turned as a whole nothing is stressed: the usual tangent is the derivative.
TEST(CorotStiffness, TurnedBody_HasTheDerivativeOfTheForces) {
  for (const Params &p :
       {Params{}, kFibers, exact(), exact(kFibers), Params{{"poisson", {0.45}}}, kNodal, exact(kNodal)}) {
    Host host;
    Instance b(host, kuhn_bar(2, 2, 1, 0.1), with(p, "damping_stiffness", 0.01));
    for (uint32_t i = 0; i < b.size(); ++i)
      b.set(b.x, i, rotate(b.mesh.at(i), (1 / std::sqrt(14.0)) * Vec{-1, 3, 2}, 2.1));
    const Dense k = tangent(b, 1, 0), c = tangent(b, 0, 1);
    EXPECT_LT(largest_difference(k, differences(b, b.x, 1e-6)), 1e-6 * largest(k));
    EXPECT_LT(largest_difference(c, differences(b, b.v, 1e-3)), 1e-9 * largest(c));
    const Dense both = tangent(b, 2, 3);
    for (size_t n = 0; n < both.value.size(); ++n)
      EXPECT_NEAR(both.value[n], 2 * k.value[n] + 3 * c.value[n], 1e-9 * largest(both));
  }
}

// Stretched in every direction the turns stiffen the cell and nothing is left out. Error of the
// differences: of second order until rounding, over decades of the step.
TEST(CorotStiffness, ExactTangentOfStretchedBody_IsTheDerivativeOverDecades) {
  for (const Params &p : {Params{}, Params{{"poisson", {0}}}, Params{{"poisson", {0.45}}},
                          Params{{"energy", {1}}}, Params{{"energy", {2}}}, kNodal}) {
    Host host;
    Instance b(host, kuhn_bar(2, 2, 1, 0.1), exact(p));
    stretch(b, p.count("energy") ? 1.1 : 1.3);
    b.shake(0.003, 0);
    const Dense k = tangent(b, 1, 0);
    double before = 0;
    for (const double step : {1e-3, 1e-4, 1e-5}) {
      const double error = largest_difference(k, differences(b, b.x, step)) / largest(k);
      if (before > 0) {
        EXPECT_LT(error, 0.02 * before) << step;
      }
      before = error;
    }
    EXPECT_LT(before, 1e-8);
    Instance usual(host, kuhn_bar(2, 2, 1, 0.1), p);
    std::copy(b.x, b.x + 4 * b.size(), usual.x);
    EXPECT_GT(largest_difference(k, tangent(usual, 1, 0)), 0.01 * largest(k));  // what the usual one lacks
  }
}

// The projection of one cell with F = x - x0: the derivative of P in F, its negative part cut off.
TEST(CorotStiffness, ExactTangentOfPressedCell_IsTheProjectedDerivative) {
  Mesh unit;
  unit.rest = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  unit.cells = {0, 1, 2, 3};
  unit.finish();
  Host host;
  for (const double kind : {0.0, 1.0, 2.0})
    for (const double size : {0.7, 0.9, 1.2}) {
      Instance b(host, unit, exact({{"poisson", {0.3}}, {"energy", {kind}}}));
      for (uint32_t i = 1; i < 4; ++i) b.set(b.x, i, rotate(size * unit.at(i), {0, 0.6, 0.8}, 1.1));
      b.shake(0.1, 0);
      const Dense k = tangent(b, 1, 0), numbers = differences(b, b.x, 1e-6);
      // points 1 to 3 move F alone: their 9 x 9 part is minus the second derivative
      double s[9][9], v[9][9];
      for (size_t i = 0; i < 9; ++i)
        for (size_t j = 0; j < 9; ++j) s[i][j] = 0.5 * (numbers(3 + i, 3 + j) + numbers(3 + j, 3 + i));
      model::jacobi(s, v);
      for (size_t i = 0; i < 9; ++i)
        for (size_t j = 0; j < 9; ++j) {
          double kept = 0;
          for (int n = 0; n < 9; ++n) kept += std::min(s[n][n], 0.0) * v[i][n] * v[j][n];
          EXPECT_NEAR(k(3 + i, 3 + j), kept, 1e-6 * largest(k)) << size;
        }
    }
}

TEST(CorotStiffness, ExactDampers_AreDifferencesByVelocity) {
  for (const Params &p : {Params{}, kFibers, kNodal}) {
    Host host;
    Instance b(host, kuhn_bar(2, 2, 1, 0.1),
               with(with(exact(p), "damping_stiffness", 0.01), "damping_mass", 3));
    stretch(b, 1.2);
    b.shake(0.01, 1);
    const Dense c = tangent(b, 0, 1);
    EXPECT_LT(largest_difference(c, differences(b, b.v, 1e-3)), 1e-9 * largest(c));
  }
}

TEST(CorotStiffness, EveryShape_IsNegativeSemidefiniteAndFinite) {
  for (const Params &p :
       {Params{}, exact(), kFibers, exact(kFibers), Params{{"poisson", {0.49}}}, exact({{"poisson", {0.49}}}),
        exact({{"energy", {1}}}), exact({{"energy", {2}}}), kNodal, exact(kNodal), Params{{"collapse", {15}}},
        exact({{"collapse", {15}}}), exact(with(kFibers, "collapse", 15))})
    for (const double size : {1.0, 0.3, 2.0, 0.0, -1.0, 10.0, -30.0}) {
      Host host;
      Instance b(host, kuhn_bar(2, 2, 1, 0.1, 0.2), with(p, "damping_stiffness", 0.01));
      for (uint32_t i = 0; i < b.size(); ++i) {
        const Vec x = b.mesh.at(i);
        b.set(b.x, i, {size * x[0], x[1], std::sqrt(std::abs(size)) * x[2]});
      }
      if (size != 0) b.shake(0.03, 1);
      const Dense m = tangent(b, 1, 0.3);
      for (const double x : m.value) ASSERT_TRUE(std::isfinite(x)) << size;
      EXPECT_TRUE(below(m, 1e-10 * largest(m))) << size;
    }
}

}  // namespace
}  // namespace corot_test
