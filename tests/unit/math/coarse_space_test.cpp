// Rigid motions of patches, patches of these, and so on, as the preconditioner of conjugate gradients: how
// many iterations bodies of several sizes take, and matrices that leave a motion without effect.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>

#include "block_system.h"
#include "grid_system.h"
#include "math/pcg_solver.h"

namespace {

using test::noise;

// A cylinder of tetrahedra, held at one end.
test::BlockSystem cylinder(uint32_t cells, double h) {
  const dfm::RestMesh mesh = dfm::make_cylinder(dfm::Memory::standard(), 0.05, 0.2, cells);
  test::BlockSystem system = test::elastic_system(mesh, 1e5, 0.3, h);
  std::vector<uint8_t> mask(system.n, 0);
  for (uint32_t i = 0; i < system.n; ++i) mask[i] = system.points[3 * size_t{i} + 2] < 1e-9 ? 7 : 0;
  dfm::hold_components(system.pattern(), mask.data(), system.blk.data());
  return system;
}

std::vector<double> solution(const test::BlockSystem &system, dfm::Tasks *tasks, dfm::SolveInfo &info) {
  dfm::PcgSolver solver(dfm::Memory::standard(), tasks);
  solver.analyse(system.pattern());
  solver.place(system.points.data(), 3);
  EXPECT_TRUE(solver.factor(system.blk.data()));
  const std::vector<double> b = noise(3 * size_t{system.n}, 7);
  std::vector<double> x(b.size(), 0.0);
  EXPECT_TRUE(solver.solve(1, b.data(), x.data(), 1e-8, info));
  return x;
}

// 4,000 points have two levels, 30,000 have three. tests/bench/solver_bench --large has up to 1,000,000.
// unsanitized: too slow there; the other tests have smaller bodies
TEST(CoarseSpace, Iterations_DoNotGrowWithTheBody) {
  for (const double h : {1.0 / 60, HUGE_VAL}) {
    uint32_t least = UINT32_MAX, most = 0;
    for (const uint32_t cells : {20000u, 52000u, 165000u}) {
      dfm::SolveInfo info;
      solution(cylinder(cells, h), nullptr, info);
      least = std::min(least, info.iterations);
      most = std::max(most, info.iterations);
    }
    EXPECT_LT(most, 1.3 * least) << h;
    EXPECT_LT(most, 90u) << h;
  }
}

TEST(CoarseSpace, ThreeLevelsOnSeveralThreads_SameBits) {
  const test::BlockSystem system = cylinder(35000, 1.0 / 60);
  ASSERT_GT(system.n, 128 * 48u);  // more points than two levels serve
  std::vector<double> first;
  for (const char *simd : {"sse2", "avx2"})
    for (const uint32_t threads : {1u, 2u, 3u}) {
      dfm::Tasks tasks(threads, nullptr, nullptr);
      setenv("DEFORM_SIMD", simd, 1);
      dfm::SolveInfo info;
      const std::vector<double> x = solution(system, &tasks, info);
      unsetenv("DEFORM_SIMD");
      if (first.empty()) first = x;
      EXPECT_EQ(std::memcmp(x.data(), first.data(), x.size() * sizeof(double)), 0) << simd << threads;
    }
}

// Adds pieces of so many points on a line, each point tied to the next by a spring along and a weak one
// across. About a line no turn moves a point, and a piece of one point has no turn at all.
void add_rods(uint32_t pieces, uint32_t points, test::BlockSystem &to) {
  const auto add = [&](uint32_t i, uint32_t j, double k, dfm::Vec3 e, double all) {
    to.ij.insert(to.ij.end(), {i, j});
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        to.blk.push_back(k * (e[r] * e[c] + (r == c ? 0.1 : 0.0)) + (r == c ? all : 0.0));
  };
  const dfm::Vec3 way = dfm::normalized({1, 0.3, -0.2});
  for (uint32_t piece = 0; piece < pieces; ++piece)
    for (uint32_t k = 0; k < points; ++k) {
      const dfm::Vec3 x = double(k) * way + dfm::Vec3{0.7 * piece, -1.1 * piece, 0.01 * points};
      to.points.insert(to.points.end(), {x.x, x.y, x.z});
      add(to.n, to.n, (k > 0) + (k + 1 < points), way, 1e-4);
      if (k) add(to.n - 1, to.n, -1, way, 0);
      ++to.n;
    }
}

// 77 patches are factored (two levels), 300 are not (three).
TEST(CoarseSpace, PiecesAndMotionsWithoutEffect_EqualTheDirectSolver) {
  for (const uint32_t times : {1u, 4u}) {
    test::BlockSystem system;
    add_rods(300 * times, 1, system);
    add_rods(60 * times, 2, system);
    add_rods(1, 500 * times, system);
    add_rods(3, 70 * times, system);
    std::vector<uint8_t> mask(system.n, 0);
    for (uint32_t i = 360 * times; i < system.n; i += 40) mask[i] = uint8_t(1 + i / 40 % 7);
    dfm::hold_components(system.pattern(), mask.data(), system.blk.data());
    const std::vector<double> b = noise(3 * size_t{system.n}, 3);
    const std::vector<double> want = test::direct_solution(system, b);
    std::vector<double> x(b.size(), 0.0);
    dfm::SolveInfo info;
    dfm::PcgSolver solver(dfm::Memory::standard());
    solver.analyse(system.pattern());
    uint32_t one_level = 0;
    for (const bool reported : {false, true}) {
      if (reported) solver.place(system.points.data(), 3);
      ASSERT_TRUE(solver.factor(system.blk.data()));
      std::fill(x.begin(), x.end(), 0.0);
      ASSERT_TRUE(solver.solve(1, b.data(), x.data(), 1e-10, info)) << info.residual;
      EXPECT_LT(test::worst(x, want), 1e-7);
      if (!reported) one_level = info.iterations;
    }
    EXPECT_LT(3 * info.iterations, 2 * one_level);
  }
}

// No point has a neighbor; all points are held; all are at one place; a position is not finite.
TEST(CoarseSpace, WithoutMotionsThatHelp_TheDiagonalBlocksServe) {
  std::vector<test::BlockSystem> systems(1);
  add_rods(300, 1, systems[0]);
  for (int n = 0; n < 3; ++n) systems.push_back(cylinder(4800, 1.0 / 60));
  const std::vector<uint8_t> all(systems[1].n, 7);
  dfm::hold_components(systems[1].pattern(), all.data(), systems[1].blk.data());
  std::fill(systems[2].points.begin(), systems[2].points.end(), 1.0);
  systems[3].points[100] = NAN;
  for (const test::BlockSystem &system : systems) {
    dfm::SolveInfo info;
    const std::vector<double> x = solution(system, nullptr, info);
    EXPECT_TRUE(dfm::all_finite(x.data(), x.size()));
  }
}

struct Refusing {
  int64_t calls = 0, refuse = -1;
  const dfm::Memory memory{this,
                           [](void *user, size_t bytes, size_t align) -> void * {
                             Refusing &own = *static_cast<Refusing *>(user);
                             const dfm::Memory &m = dfm::Memory::standard();
                             return own.calls++ == own.refuse ? nullptr : m.alloc(m.user, bytes, align);
                           },
                           dfm::Memory::standard().release};
};

// Three levels; tests/unit/math/linear_solver_test.cpp refuses each allocation of two.
TEST(CoarseSpace, FactorWithoutMemory_LeavesNoneUntilTheNext) {
  const test::BlockSystem system = cylinder(35000, 1.0 / 60);
  ASSERT_GT(system.n, 128 * 48u);
  const std::vector<double> b = noise(3 * size_t{system.n}, 7);
  dfm::SolveInfo info;
  bool refused = true;
  for (int64_t k = 0; refused; k += 10) {
    Refusing some;
    std::vector<double> x(b.size(), 0.0);
    dfm::PcgSolver solver(some.memory);
    solver.analyse(system.pattern());
    solver.place(system.points.data(), 3);
    some.refuse = some.calls + k;
    try {
      refused = false;
      EXPECT_TRUE(solver.factor(system.blk.data()));
    } catch (const std::bad_alloc &) {
      refused = true;
      EXPECT_FALSE(solver.solve(1, b.data(), x.data(), 1e-2, info)) << k;
    }
    EXPECT_TRUE(refused || k > 50);
    solver.place(system.points.data(), 3);
    EXPECT_TRUE(solver.factor(system.blk.data()));
    EXPECT_TRUE(solver.solve(1, b.data(), x.data(), 1e-2, info)) << k;
  }
}

TEST(CoarseSpace, MatrixThatIsNotPositiveDefinite_IsReported) {
  test::Grid g = test::grid(22, 21, 20, -0.5);
  const std::vector<double> b = noise(3 * size_t{g.n}, 3);
  std::vector<double> x(b.size(), 0.0);
  dfm::PcgSolver solver(dfm::Memory::standard());
  solver.analyse(g.pattern());
  solver.place(g.points.data(), 3);
  ASSERT_TRUE(solver.factor(g.blk.data()));
  dfm::SolveInfo info;
  EXPECT_FALSE(solver.solve(1, b.data(), x.data(), 1e-9, info));
  EXPECT_TRUE(info.indefinite);
  EXPECT_TRUE(dfm::all_finite(x.data(), x.size()));
  for (size_t k = 0; k < g.ij.size() / 2; ++k)  // nothing ties or weighs point 5000
    if (g.ij[2 * k] == 5000 || g.ij[2 * k + 1] == 5000) std::fill_n(&g.blk[9 * k], 9, 0.0);
  solver.place(g.points.data(), 3);
  EXPECT_FALSE(solver.factor(g.blk.data()));
}

}  // namespace
