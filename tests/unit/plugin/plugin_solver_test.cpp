// A linear solver of a plugin behind the interface of the library's own.
#include "plugin/plugin_solver.h"

#ifdef DEFORM_PETSC
#include <dlfcn.h>
#include <signal.h>

#include <cmath>
#include <thread>
#endif

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

#ifdef DEFORM_PETSC
constexpr const char *kPetsc[] = {"petsc_gamg", "petsc_hypre", "petsc_mumps"};

struct WithPetsc : tiny::Context {
  WithPetsc() { EXPECT_EQ(dfm_plugin_load(c, DEFORM_PETSC), DFM_OK) << dfm_last_error(); }
  std::unique_ptr<dfm::LinearSolver> solver(const char *name, const test::Grid &g) const {
    auto made = dfm::make_solver({name, g.n, false, 0}, *c, memory(), nullptr);
    made->analyse(g.pattern());
    return made;
  }
};

void equal_the_own(const WithPetsc &context, const char *name) {
  const test::Grid g = test::grid(9, 8, 7, 0.05), twice = [&] {
    test::Grid other = g;
    for (double &v : other.blk) v *= 2;
    return other;
  }();
  const std::vector<double> b = test::noise(3 * size_t{g.n}, 1);
  const auto solver = context.solver(name, g);
  dfm::SolveInfo info;
  for (const test::Grid *matrix : {&twice, &g}) {
    std::vector<double> x = test::noise(b.size(), 2);  // any start
    ASSERT_TRUE(solver->factor(matrix->blk.data())) << name;
    ASSERT_TRUE(solver->solve(1, b.data(), x.data(), 1e-12, info)) << name;
    EXPECT_LT(test::worst(x, test::direct_solution(*matrix, b)), 1e-10) << name;
  }
  std::vector<double> x = test::noise(2 * b.size(), 3), zeros = b;
  zeros.resize(2 * b.size(), 0.0);
  ASSERT_TRUE(solver->solve(2, zeros.data(), x.data(), 1e-12, info)) << name;
  EXPECT_EQ(std::vector<double>(x.begin() + ptrdiff_t(b.size()), x.end()),
            std::vector<double>(b.size(), 0.0));
}

// Also run by two ranks: petsc_ranks.py.
TEST(PluginSolver, Petsc_EqualsTheOwnFactorization) {
  const WithPetsc context;
  for (const char *name : kPetsc) equal_the_own(context, name);
}

TEST(PluginSolver, Petsc_MatrixThatIsNotPositiveDefinite_IsReported) {
  const WithPetsc context;
  for (const char *name : kPetsc)
    for (test::Grid bad : {test::grid(9, 8, 7, -1.0), test::grid(2, 1, 1, -1.0), test::grid(3, 3, 3, 1.0)}) {
      if (bad.n == 27) bad.blk[4] = NAN;
      const auto solver = context.solver(name, bad);
      std::vector<double> b(3 * size_t{bad.n}, 0.0), x = b;
      for (size_t k = 0; k < b.size(); ++k) b[k] = double(k % 7) - 3;
      dfm::SolveInfo info;
      EXPECT_FALSE(solver->factor(bad.blk.data()) && solver->solve(1, b.data(), x.data(), 1e-9, info))
          << name << ", " << bad.n << " points";
    }
}

TEST(PluginSolver, Petsc_LeavesTheHandlersOfSignals) {
  struct sigaction before[32], after;
  for (int k = 1; k < 32; ++k) sigaction(k, nullptr, &before[k]);
  const WithPetsc context;
  equal_the_own(context, "petsc_gamg");
  for (int k = 1; k < 32; ++k) {
    sigaction(k, nullptr, &after);
    EXPECT_EQ(before[k].sa_handler, after.sa_handler) << k;
  }
}

// The host starts MPI before and ends it while a solver lives.
TEST(PluginSolver, Petsc_ServesAHostThatUsesMpi) {
  void *const file = dlopen(DEFORM_PETSC, RTLD_NOW);
  ASSERT_TRUE(file) << dlerror();
  using Init = int (*)(int *, char ***);
  ASSERT_EQ(reinterpret_cast<Init>(dlsym(file, "MPI_Init"))(nullptr, nullptr), 0);
  {
    const WithPetsc context;
    equal_the_own(context, "petsc_gamg");
    const test::Grid g = test::grid(3, 3, 3, 1.0);
    const auto solver = context.solver("petsc_mumps", g);
    dfm_status elsewhere = DFM_OK;  // MPI_Init promises one thread
    std::thread([&] { elsewhere = solver->factor(g.blk.data()) ? DFM_OK : DFM_E_UNSUPPORTED; }).join();
    EXPECT_EQ(elsewhere, DFM_E_UNSUPPORTED);
    EXPECT_TRUE(solver->factor(g.blk.data()));
    ASSERT_EQ(reinterpret_cast<int (*)()>(dlsym(file, "MPI_Finalize"))(), 0);
    EXPECT_FALSE(solver->factor(g.blk.data()));
  }
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
