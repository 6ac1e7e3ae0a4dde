// Linear solvers of symmetric positive definite matrices of 3x3 blocks against dense solutions.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <vector>

#include "block_system.h"
#include "grid_system.h"
#include "math/ldlt_solver.h"
#include "math/make_solver.h"
#include "math/pcg_solver.h"

namespace {

using test::dense;
using test::Grid;
using test::grid;
using test::noise;
using test::worst;

using Made = std::unique_ptr<dfm::LinearSolver>;
const std::vector<std::pair<const char *, std::function<Made(dfm::Tasks *)>>> kSolvers = {
    {"ldlt", [](dfm::Tasks *t) { return std::make_unique<dfm::LdltSolver>(dfm::Memory::standard(), t); }},
    {"pcg", [](dfm::Tasks *t) { return std::make_unique<dfm::PcgSolver>(dfm::Memory::standard(), t); }},
};

TEST(BlockMatrix, Product_EqualsDense) {
  const Grid g = grid(4, 3, 3, 0.1);
  const std::vector<double> x = noise(3 * g.n, 2);
  dfm::BlockMatrix m(dfm::Memory::standard());
  m.set_pattern(g.pattern());
  m.set_values(nullptr, g.blk.data());
  std::vector<double> y(x.size());
  m.multiply(0, g.n, x.data(), y.data());
  EXPECT_LT(worst(y, dense(g) * x), 1e-15);
}

TEST(BlockMatrix, HeldComponents_AreThoseOfTheIdentity) {
  Grid g = grid(3, 3, 2, 0.1);
  std::vector<uint8_t> mask(g.n, 0);
  mask[1] = 7;
  mask[4] = 2;
  mask[5] = 5;
  const test::Dense before = dense(g);
  hold_components(g.pattern(), mask.data(), g.blk.data());
  const test::Dense after = dense(g);
  const size_t m = 3 * g.n;
  for (size_t r = 0; r < m; ++r)
    for (size_t c = 0; c < m; ++c) {
      const bool held = (mask[r / 3] >> r % 3 & 1) || (mask[c / 3] >> c % 3 & 1);
      EXPECT_EQ(after(r, c), held ? (r == c ? 1.0 : 0.0) : before(r, c)) << r << ' ' << c;
    }
}

TEST(LinearSolver, SeveralRightHandSides_EqualDense) {
  Grid g = grid(4, 3, 3, 0.05);
  std::vector<uint8_t> mask(g.n, 0);
  mask[0] = 7;
  mask[7] = 1;
  hold_components(g.pattern(), mask.data(), g.blk.data());
  const size_t m = 3 * g.n;
  const test::Dense a = dense(g);
  for (const auto &[name, make] : kSolvers) {
    SCOPED_TRACE(name);
    const Made solver = make(nullptr);
    EXPECT_STREQ(solver->name(), name);
    solver->analyse(g.pattern());
    for (double scale : {1.0, 3.0}) {  // factor again on the same pattern
      std::vector<double> blk = g.blk;
      for (double &v : blk) v *= scale;
      ASSERT_TRUE(solver->factor(blk.data()));
      for (uint32_t nrhs : {1u, 7u, 8u, 19u}) {
        const std::vector<double> b = noise(nrhs * m, nrhs);
        std::vector<double> x(b.size(), 0.0);
        dfm::SolveInfo info;
        ASSERT_TRUE(solver->solve(nrhs, b.data(), x.data(), 1e-13, info));
        EXPECT_EQ(info.iterations == 0, solver->direct());
        EXPECT_LE(info.residual, 1e-13);
        for (uint32_t k = 0; k < nrhs; ++k) {
          std::vector<double> want = test::solved(a, std::vector<double>(&b[k * m], &b[k * m] + m));
          for (double &v : want) v /= scale;
          EXPECT_LT(worst(std::vector<double>(&x[k * m], &x[k * m] + m), want), 1e-11);
        }
      }
    }
  }
}

TEST(Ldlt, RestrictedInverse_EqualsUnitResponses) {
  const Grid g = grid(4, 3, 3, 0.05);
  const std::vector<uint32_t> sel = {30, 2, 17, 5, 11};
  const size_t m = 3 * g.n, wide = 3 * sel.size();
  const test::Dense a = dense(g);
  std::vector<double> want(wide * wide);
  for (size_t c = 0; c < wide; ++c) {
    std::vector<double> unit(m, 0.0);
    unit[3 * sel[c / 3] + c % 3] = 1;
    unit = test::solved(a, unit);
    for (size_t r = 0; r < wide; ++r) want[r * wide + c] = unit[3 * sel[r / 3] + r % 3];
  }
  std::vector<double> first;
  for (const char *simd : {"sse2", "avx2", "avx512"})
    for (const uint32_t threads : {1u, 2u, 4u}) {
      dfm::Tasks tasks(threads, nullptr, nullptr);
      setenv("DEFORM_SIMD", simd, 1);
      dfm::LdltSolver solver(dfm::Memory::standard(), &tasks);
      unsetenv("DEFORM_SIMD");
      solver.analyse(g.pattern());
      std::vector<double> w(wide * wide);
      EXPECT_FALSE(solver.restricted(uint32_t(sel.size()), sel.data(), w.data()));
      ASSERT_TRUE(solver.factor(g.blk.data()));
      ASSERT_TRUE(solver.restricted(uint32_t(sel.size()), sel.data(), w.data()));
      EXPECT_LT(worst(w, want), 1e-12);
      for (size_t r = 0; r < wide; ++r)
        for (size_t c = 0; c < r; ++c) EXPECT_EQ(w[r * wide + c], w[c * wide + r]);
      if (first.empty()) first = w;
      EXPECT_EQ(w, first) << simd << threads;
    }
}

TEST(LinearSolver, SeveralThreads_SameBits) {
  const Grid g = grid(10, 9, 8, 0.05);
  const size_t m = 3 * g.n;
  const std::vector<double> b = noise(9 * m, 5);
  for (const auto &[name, make] : kSolvers) {
    SCOPED_TRACE(name);
    std::vector<double> first_x;
    for (uint32_t threads : {1u, 2u, 4u}) {
      dfm::Tasks tasks(threads, nullptr, nullptr);
      const Made solver = make(&tasks);
      solver->analyse(g.pattern());
      solver->place(g.points.data(), 3);
      ASSERT_TRUE(solver->factor(g.blk.data()));
      std::vector<double> x(b.size(), 0.0);
      dfm::SolveInfo info;
      ASSERT_TRUE(solver->solve(9, b.data(), x.data(), 1e-6, info));
      if (threads == 1) first_x = x;
      EXPECT_EQ(std::memcmp(x.data(), first_x.data(), x.size() * sizeof(double)), 0) << threads;
    }
  }
}

TEST(LinearSolver, VectorWidths_SameBits) {
  const Grid g = grid(8, 8, 6, 0.05);
  const size_t m = 3 * g.n;
  const std::vector<double> b = noise(10 * m, 5);
  for (const auto &[name, make] : kSolvers) {
    std::vector<double> first;
    for (const char *simd : {"sse2", "avx2", "avx512"}) {
      setenv("DEFORM_SIMD", simd, 1);
      const Made solver = make(nullptr);
      unsetenv("DEFORM_SIMD");
      solver->analyse(g.pattern());
      solver->place(g.points.data(), 3);
      ASSERT_TRUE(solver->factor(g.blk.data()));
      std::vector<double> out(11 * m, 0.0);
      dfm::SolveInfo info;
      ASSERT_TRUE(solver->solve(10, b.data(), out.data(), 1e-8, info));
      ASSERT_TRUE(solver->solve(1, b.data(), &out[10 * m], 1e-8, info));
      if (first.empty()) first = out;
      EXPECT_EQ(std::memcmp(out.data(), first.data(), out.size() * sizeof(double)), 0) << name << simd;
    }
  }
}

TEST(LinearSolver, MatrixThatIsNotPositiveDefinite_IsReportedAndNothingIsSolved) {
  const std::vector<double> b(3 * 36, 1.0);
  for (double mass : {0.0, -0.5}) {  // free to move as a whole; and worse
    const Grid g = grid(4, 3, 3, mass);
    dfm::LdltSolver direct(dfm::Memory::standard());
    direct.analyse(g.pattern());
    EXPECT_FALSE(direct.factor(g.blk.data())) << mass;
    std::vector<double> x(b.size(), 7.0);
    dfm::SolveInfo info;
    EXPECT_FALSE(direct.solve(1, b.data(), x.data(), 1e-9, info));
    EXPECT_EQ(x, std::vector<double>(b.size(), 7.0));
  }
  // Conjugate gradients meet the curvature on their way.
  const Grid g = grid(4, 3, 3, -0.5);
  dfm::PcgSolver iterative(dfm::Memory::standard());
  iterative.analyse(g.pattern());
  ASSERT_TRUE(iterative.factor(g.blk.data()));
  std::vector<double> x(b.size(), 0.0);
  dfm::SolveInfo info;
  EXPECT_FALSE(iterative.solve(1, b.data(), x.data(), 1e-9, info));
  EXPECT_TRUE(info.indefinite);
  for (double v : x) EXPECT_TRUE(std::isfinite(v));
  // A diagonal block that is not positive definite is told by factor().
  std::vector<double> blk = g.blk;
  for (size_t k = 0; k < g.ij.size() / 2; ++k)
    if (g.ij[2 * k] == g.ij[2 * k + 1]) blk[9 * k + 4] = -1;
  EXPECT_FALSE(iterative.factor(blk.data()));
}

// Held points lie in many patches: no motion of a patch may move them.
TEST(PcgSolver, PlacesOfThePoints_SpareTwoThirdsOfTheIterations) {
  const dfm::RestMesh mesh = dfm::make_cylinder(dfm::Memory::standard(), 0.02, 0.2, 2500);
  test::BlockSystem system = test::elastic_system(mesh, 1e6, 0.3, 1.0 / 60);
  std::vector<uint8_t> mask(system.n, 0);
  for (uint32_t i = 0; i < system.n; ++i) mask[i] = system.points[3 * size_t{i} + 2] < 1e-9 ? 7 : i % 7 == 0;
  dfm::hold_components(system.pattern(), mask.data(), system.blk.data());
  const std::vector<double> b = noise(3 * size_t{system.n}, 3);
  const std::vector<double> want = test::direct_solution(system, b);
  dfm::SolveInfo one, two;
  dfm::PcgSolver solver(dfm::Memory::standard());
  solver.analyse(system.pattern());
  for (dfm::SolveInfo *reported : {&one, &two}) {
    if (reported == &two) solver.place(system.points.data(), 3);
    ASSERT_TRUE(solver.factor(system.blk.data()));
    std::vector<double> x(b.size(), 0.0);
    ASSERT_TRUE(solver.solve(1, b.data(), x.data(), 1e-9, *reported));
    EXPECT_LT(worst(x, want), 1e-6);
  }
  EXPECT_LT(3 * two.iterations, one.iterations);
}

TEST(PcgSolver, StartAtTheSolution_TakesNoIteration) {
  const Grid g = grid(5, 4, 4, 0.05);
  const std::vector<double> b = noise(3 * g.n, 3);
  dfm::PcgSolver solver(dfm::Memory::standard());
  solver.analyse(g.pattern());
  ASSERT_TRUE(solver.factor(g.blk.data()));
  std::vector<double> x(b.size(), 0.0);
  dfm::SolveInfo cold, warm;
  ASSERT_TRUE(solver.solve(1, b.data(), x.data(), 1e-10, cold));
  EXPECT_GT(cold.iterations, 5u);
  ASSERT_TRUE(solver.solve(1, b.data(), x.data(), 1e-9, warm));
  EXPECT_EQ(warm.iterations, 0u);
}

TEST(PcgSolver, LimitOfIterations_IsReportedWithTheBestResult) {
  const Grid g = grid(5, 4, 4, 0.01);
  const std::vector<double> b = noise(3 * g.n, 3);
  dfm::PcgSolver solver(dfm::Memory::standard(), nullptr, 3);
  solver.analyse(g.pattern());
  ASSERT_TRUE(solver.factor(g.blk.data()));
  std::vector<double> x(b.size(), 0.0);
  dfm::SolveInfo info;
  EXPECT_FALSE(solver.solve(1, b.data(), x.data(), 1e-10, info));
  EXPECT_EQ(info.iterations, 3u);
  EXPECT_FALSE(info.indefinite);
  EXPECT_GT(info.residual, 1e-10);
  EXPECT_LT(info.residual, 1.0);
}

// Every allocation through the hooks is refused once: the failure is told, nothing is lost, and a later try
// works.
TEST(LinearSolver, RefusedMemory_IsReportedAndNothingLeaks) {
  struct Refusing {
    int64_t calls = 0, refuse = -1, live = 0;
    dfm::Memory memory{this,
                       [](void *user, size_t bytes, size_t align) -> void * {
                         Refusing &r = *static_cast<Refusing *>(user);
                         if (r.calls++ == r.refuse) return nullptr;
                         ++r.live;
                         const dfm::Memory &s = dfm::Memory::standard();
                         return s.alloc(s.user, bytes, align);
                       },
                       [](void *user, void *p, size_t bytes, size_t align) {
                         --static_cast<Refusing *>(user)->live;
                         const dfm::Memory &s = dfm::Memory::standard();
                         s.release(s.user, p, bytes, align);
                       }};
  };
  const Grid g = grid(7, 6, 5, 0.05);
  const std::vector<double> b = noise(9 * 3 * size_t{g.n}, 5);
  for (const char *name : {"ldlt", "pcg"}) {
    int64_t refused = 0;
    for (int64_t k = 0;; ++k) {
      Refusing r;
      bool done = false;
      {
        const Made solver = dfm::own_solver({name, g.n, false, 0}, r.memory, nullptr);
        const auto work = [&] {
          std::vector<double> x(b.size(), 0.0);
          dfm::SolveInfo info;
          solver->analyse(g.pattern());
          solver->place(g.points.data(), 3);
          return solver->factor(g.blk.data()) && solver->solve(1, b.data(), x.data(), 1e-2, info) &&
                 solver->solve(9, b.data(), x.data(), 1e-2, info);
        };
        r.refuse = k;
        try {
          done = work();
        } catch (const std::bad_alloc &) {
          ++refused;
          EXPECT_TRUE(work()) << name << k;
        }
        const int64_t settled = r.calls;
        EXPECT_TRUE(work());
        EXPECT_EQ(r.calls, settled) << name << " allocates once its capacities have settled";
      }
      EXPECT_EQ(r.live, 0) << name << k;
      if (done) break;
    }
    EXPECT_GT(refused, 10) << name;
  }
}

TEST(SolverChoice, AutomaticChoice_FactorsSmallAndConstantMatrices) {
  EXPECT_STREQ(dfm::solver_name({"auto", 300, false, 0}), "ldlt");
  EXPECT_STREQ(dfm::solver_name({"auto", 20001, false, 0}), "pcg");
  EXPECT_STREQ(dfm::solver_name({"auto", 20001, true, 0}), "ldlt");
  EXPECT_STREQ(dfm::solver_name({"pcg", 300, true, 0}), "pcg");
  for (const char *name : {"ldlt", "pcg"})
    EXPECT_STREQ(dfm::own_solver({name, 1, false, 0}, dfm::Memory::standard(), nullptr)->name(), name);
  EXPECT_EQ(dfm::own_solver({"lu", 1, false, 0}, dfm::Memory::standard(), nullptr), nullptr);
}

}  // namespace
