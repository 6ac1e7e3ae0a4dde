// A linear solver of a plugin behind the interface of the library's own.
#include "plugin/plugin_solver.h"

#include "../../plugin/tiny_support.h"
#include "../math/grid_system.h"
#include "core/error.h"

namespace {

const dfm::Memory &memory() { return dfm::Memory::standard(); }

struct Loaded : tiny::Context {
  Loaded() { EXPECT_EQ(dfm_plugin_load(c, tiny::plugin("tiny_solver").c_str()), DFM_OK) << dfm_last_error(); }
  std::unique_ptr<dfm::LinearSolver> solver(const char *name = "cholesky") const {
    return dfm::make_solver({name, 36, false, 0}, *c, memory(), nullptr);
  }
};

TEST(PluginSolver, Solutions_EqualDense) {
  const Loaded context;
  const auto solver = context.solver();
  EXPECT_STREQ(solver->name(), "org.tiny.cholesky");
  EXPECT_TRUE(solver->direct());
  const test::Grid g = test::grid(4, 3, 3, 0.05);
  const size_t m = 3 * size_t{g.n};
  const test::Dense a = test::dense(g);
  const std::vector<double> b = test::noise(2 * m, 1);
  std::vector<double> x(2 * m, 0.0);
  dfm::SolveInfo info;
  EXPECT_FALSE(solver->solve(1, b.data(), x.data(), 1e-9, info));  // nothing to solve with yet
  solver->analyse(g.pattern());
  EXPECT_FALSE(solver->solve(1, b.data(), x.data(), 1e-9, info));
  ASSERT_TRUE(solver->factor(g.blk.data()));
  ASSERT_TRUE(solver->solve(2, b.data(), x.data(), 1e-9, info));
  for (size_t k = 0; k < 2; ++k)
    EXPECT_LT(test::worst(std::vector<double>(&x[k * m], &x[k * m] + m),
                          test::solved(a, std::vector<double>(&b[k * m], &b[k * m] + m))),
              1e-11);
}

TEST(PluginSolver, MatrixThatIsNotPositiveDefinite_IsReportedAndNothingIsSolved) {
  const Loaded context;
  const auto solver = context.solver();
  const test::Grid g = test::grid(3, 3, 3, -1.0);
  solver->analyse(g.pattern());
  EXPECT_FALSE(solver->factor(g.blk.data()));
  std::vector<double> b(3 * size_t{g.n}, 1.0), x(b.size(), 7.0);
  dfm::SolveInfo info;
  EXPECT_FALSE(solver->solve(1, b.data(), x.data(), 1e-9, info));
  EXPECT_EQ(x, std::vector<double>(b.size(), 7.0));
}

TEST(PluginSolver, RefusedMatrix_NamesThePlugin) {
  const Loaded context;
  const auto solver = context.solver();
  const test::Grid large = test::grid(5, 5, 5, 1.0), small = test::grid(2, 2, 2, 1.0);
  try {
    solver->analyse(large.pattern());
    FAIL();
  } catch (const dfm::Error &e) {
    EXPECT_EQ(e.sentence, "solver 'org.tiny.cholesky' cannot take a matrix of 125 points; see the log");
  }
  EXPECT_FALSE(solver->factor(large.blk.data()));  // no matrix to factor
  solver->analyse(small.pattern());                // and it can still be used
  EXPECT_TRUE(solver->factor(small.blk.data()));
}

#ifdef DEFORM_HAS_CHOLMOD
TEST(PluginSolver, Cholmod_EqualsTheOwnFactorization) {
  const std::string file = std::string(DEFORM_PLUGIN_DIR) + "/solver_cholmod.so";
  setenv("OMP_THREAD_LIMIT", "1", 1);  // else threads of OpenMP and of the BLAS wait for each other
  setenv("OPENBLAS_NUM_THREADS", "1", 1);
  const tiny::Context context;
  ASSERT_EQ(dfm_plugin_load(context.c, file.c_str()), DFM_OK) << dfm_last_error();
  const test::Grid g = test::grid(9, 8, 7, 0.05);
  const std::vector<double> b = test::noise(9 * size_t{g.n}, 1);
  std::vector<double> results[2];
  for (const char *name : {"ldlt", "cholmod"}) {
    const auto solver = dfm::make_solver({name, g.n, false, 0}, *context.c, memory(), nullptr);
    solver->analyse(g.pattern());
    for (double scale : {2.0, 1.0}) {
      std::vector<double> blk = g.blk;
      for (double &v : blk) v *= scale;
      ASSERT_TRUE(solver->factor(blk.data()));
    }
    std::vector<double> &x = results[name[0] == 'c'];
    x.resize(b.size());
    dfm::SolveInfo info;
    ASSERT_TRUE(solver->solve(3, b.data(), x.data(), 0, info));
    for (const test::Grid &bad : {test::grid(9, 8, 7, -1.0), test::grid(2, 1, 1, -1.0)}) {
      solver->analyse(bad.pattern());
      EXPECT_FALSE(solver->factor(bad.blk.data())) << name << ", " << bad.n << " points";
    }
  }
  EXPECT_LT(test::worst(results[1], results[0]), 1e-11);
}
#endif

TEST(PluginSolver, Name_FindsOwnSolversAndPluginsElseListsThem) {
  const Loaded context;
  EXPECT_STREQ(context.solver("ldlt")->name(), "ldlt");
  EXPECT_STREQ(context.solver("auto")->name(), "ldlt");
  EXPECT_STREQ(context.solver("org.tiny.cholesky")->name(), "org.tiny.cholesky");
  try {
    context.solver("cholmod");
    FAIL();
  } catch (const dfm::Error &e) {
    EXPECT_EQ(e.sentence, "no linear solver \"cholmod\" is loaded; choose auto, ldlt, pcg, cholesky");
  }
}

}  // namespace
