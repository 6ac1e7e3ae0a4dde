// The host's direct solver in a plugin's hands: what dfm_host.extension answers to "dfm.direct/1".
#include "../math/grid_system.h"
#include "deform/plugin_draft.h"
#include "math/ldlt_solver.h"
#include "math/nested_dissection.h"
#include "plugin/context.h"
#include "support.h"
#include "world.h"

namespace {

const dfm_direct &service(dfm_context *c) {
  return *static_cast<const dfm_direct *>(c->host.extension(c->host.ctx, DFM_HOST_DIRECT));
}

struct Factor {
  test::Context context;
  const dfm_direct &direct = service(context);
  void *self = nullptr;
  Factor(const test::Grid &g, const double *places) {
    const auto b = uint32_t(g.ij.size() / 2);
    const dfm_host *const host = &static_cast<dfm_context *>(context)->host;
    test::ok(places ? direct.analyse(host, g.n, b, g.ij.data(), places, &self)
                    : direct.solver->analyse(host, g.n, b, g.ij.data(), &self));
  }
  ~Factor() { direct.solver->release(self); }
};

TEST(DirectService, OtherIds_AreUnknown) {
  const test::Context context;
  dfm_context *const c = context;
  EXPECT_EQ(c->host.extension(c->host.ctx, "dfm.direct/2"), nullptr);
  EXPECT_EQ(service(c).size, sizeof(dfm_direct));
  EXPECT_TRUE(service(c).solver->flags & DFM_SOLVER_DIRECT);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(DirectService, SolutionsAndPartOfTheInverse_EqualDense) {
  const test::Grid g = test::grid(9, 4, 5, 0.05);
  const size_t m = 3 * size_t{g.n};
  const test::Dense a = test::dense(g);
  const std::vector<double> b = test::noise(m, 1), with = test::solved(a, b);
  const std::vector<uint32_t> sel = {170, 2, 17};
  std::vector<std::vector<double>> columns;
  for (size_t c = 0; c < 9; ++c) {
    std::vector<double> unit(m, 0.0);
    unit[3 * sel[c / 3] + c % 3] = 1;
    columns.push_back(test::solved(a, unit));
  }
  for (const double *places : {static_cast<const double *>(nullptr), g.points.data()}) {
    const Factor f(g, places);
    std::vector<double> x(m);
    ASSERT_EQ(f.direct.solver->factor(f.self, g.blk.data()), DFM_OK);
    ASSERT_EQ(f.direct.solver->solve(f.self, 1, b.data(), x.data(), 0), DFM_OK);
    EXPECT_LT(test::worst(x, with), 1e-11);
    std::vector<double> w(81);
    for (int twice = 0; twice < 2; ++twice) {
      ASSERT_EQ(f.direct.inverse_at(f.self, 3, sel.data(), w.data()), DFM_OK);
      for (size_t c = 0; c < 9; ++c) {
        const double largest = columns[c][3 * sel[c / 3] + c % 3];
        for (size_t r = 0; r < 9; ++r) {
          EXPECT_NEAR(w[9 * r + c], columns[c][3 * sel[r / 3] + r % 3], 1e-10 * largest);
          EXPECT_EQ(w[9 * r + c], w[9 * c + r]);
        }
      }
    }
  }
}

TEST(DirectService, MatrixThatIsNotPositiveDefinite_IsDiscarded) {
  test::Grid g = test::grid(3, 3, 3, 0.05);
  const Factor f(g, g.points.data());
  for (double &value : g.blk) value = -value;
  EXPECT_EQ(f.direct.solver->factor(f.self, g.blk.data()), DFM_DISCARD);
  std::vector<double> b(81, 1.0), x(81);
  EXPECT_EQ(f.direct.solver->solve(f.self, 1, b.data(), x.data(), 0), DFM_DISCARD);
}

// Each point once; of a block of points fewer entries than by minimum degree.
TEST(NestedDissection, Block_HasASmallerFactor) {
  const test::Grid g = test::grid(16, 16, 8, 1);
  std::vector<uint32_t> order(g.n);
  dfm::nested_dissection(g.pattern(), g.points.data(), order.data());
  std::vector<uint8_t> seen(g.n, 0);
  for (const uint32_t i : order) {
    ASSERT_LT(i, g.n);
    ++seen[i];
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), std::ptrdiff_t(g.n));
  dfm::LdltSolver by_degree(dfm::Memory::standard()), by_planes(dfm::Memory::standard());
  by_degree.analyse(g.pattern());
  by_planes.analyse(g.pattern(), g.points.data());
  EXPECT_LT(double(by_planes.factor_doubles()), 0.9 * double(by_degree.factor_doubles()));
}

// Points on one place cannot be cut apart.
TEST(NestedDissection, PointsOnOnePlace_AreAllOrdered) {
  const test::Grid g = test::grid(8, 8, 8, 1);
  const std::vector<double> places(3 * size_t{g.n}, 0.0);
  std::vector<uint32_t> order(g.n);
  dfm::nested_dissection(g.pattern(), places.data(), order.data());
  std::sort(order.begin(), order.end());
  for (uint32_t i = 0; i < g.n; ++i) EXPECT_EQ(order[i], i);
}

}  // namespace
