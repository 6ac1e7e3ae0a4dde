#include "geometry/voxel_grid.h"

#include <gtest/gtest.h>

#include "../narrow/detect_scene.h"
#include "geometry/closest.h"

namespace {

using namespace dfm;
using namespace test;

VoxelGrid grid_of(const Mesh &m, uint32_t cells) {
  return VoxelGrid(Memory::standard(), m.x.data(), m.ntri(), m.tri.data(), cells);
}

// Distance to the triangles, with the sign of the shape that they are made from.
double true_distance(const Mesh &m, Vec3 p, bool inside) {
  double d2 = INFINITY;
  for (uint32_t t = 0; t < m.ntri(); ++t)
    d2 = std::min(
        d2,
        closest_on_triangle(p, m.at(m.tri[3 * t]), m.at(m.tri[3 * t + 1]), m.at(m.tri[3 * t + 2])).distance2);
  return inside ? -std::sqrt(d2) : std::sqrt(d2);
}

struct Errors {
  double near = 0, far = 0, tilt = 0;
  uint32_t wrong_side = 0;
};

// Against the true distance at places in and around the box; near: within two cells of the surface.
template <class Inside>
Errors errors_of(const Mesh &m, const VoxelGrid &g, Inside inside) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-0.05, 1.05);
  Errors e;
  for (int i = 0; i < 3000; ++i) {
    Vec3 p;
    for (int k = 0; k < 3; ++k) p[k] = g.low()[k] + u(random) * (g.high()[k] - g.low()[k]);
    const double want = true_distance(m, p, inside(p));
    const VoxelGrid::Value v = g.at(p);
    double &worst = std::fabs(want) < 2 * g.cell() ? e.near : e.far;
    worst = std::max(worst, std::fabs(v.distance - want));
    if (std::fabs(want) > g.cell()) e.wrong_side += (want < 0) != (v.distance < 0);
  }
  return e;
}

Mesh cube() { return moved(box_mesh({1, 0.8, 0.6}, 2, 2, 2), turn({1, 2, 3}, 0.7), {0.1, 0.2, 0.3}); }
bool in_cube(Vec3 p) {
  const Vec3 q = rotate_back(turn({1, 2, 3}, 0.7), p - Vec3{0.1, 0.2, 0.3});
  return std::fabs(q.x) < 0.5 && std::fabs(q.y) < 0.4 && std::fabs(q.z) < 0.3;
}

}  // namespace

// Smooth walls: the error falls with the square of the cell. Rims and corners are rounded off by a
// share of a cell.
// unsanitized: too slow there; shorter tests run the same code
TEST(VoxelGrid, Distance_IsTrueToAShareOfACell) {
  const Mesh ball = sphere_mesh(0.5, 4), box = cube();
  double last = INFINITY;
  for (const uint32_t cells : {1000u, 8000u}) {
    const VoxelGrid g = grid_of(ball, cells);
    const Errors e =
        errors_of(ball, g, [&](Vec3 p) { return g.at(p).distance < 0 ? norm(p) < 0.52 : norm(p) < 0.48; });
    EXPECT_EQ(e.wrong_side, 0u);
    // An eighth of the cell's square times the distance's second derivatives, 2 / r, on the smallest of the
    // spheres that count; and an eighth of the cell times the fold between facets.
    const double bound = g.cell() * g.cell() / 4 / (0.5 - 2 * g.cell()) + 0.1 * g.cell() / 8;
    EXPECT_LT(e.near, bound) << cells;
    EXPECT_LT(e.near, last / 2.5) << "half the cell, a quarter of the error, but for facets";
    EXPECT_LT(g.error(), bound);
    last = e.near;
  }
  for (const uint32_t cells : {1000u, 8000u, 64000u}) {
    const VoxelGrid g = grid_of(box, cells);
    const Errors e = errors_of(box, g, in_cube);
    EXPECT_EQ(e.wrong_side, 0u);
    EXPECT_LT(e.near, 0.45 * g.cell()) << "rims, " << cells;
    EXPECT_LT(e.far, 0.6 * VoxelGrid::kBrick * g.cell()) << "between bricks, " << cells;
  }
}

TEST(VoxelGrid, FlatWall_IsExact) {
  const Mesh box = cube();
  const VoxelGrid g = grid_of(box, 8000);
  const Quat q = turn({1, 2, 3}, 0.7);
  for (double x = -0.2; x <= 0.2; x += 0.04)
    for (double z = 0.26; z < 0.36; z += 0.01) {
      const VoxelGrid::Value v = g.at(rotate(q, {x, 0.3 * x, z}) + Vec3{0.1, 0.2, 0.3});
      EXPECT_NEAR(v.distance, z - 0.3, 1e-7);  // floats
      EXPECT_LT(norm(v.gradient - rotate(q, {0, 0, 1})), 1e-5);
    }
}

// The surface grows by 4 where the cells grow by 8: so does memory.
TEST(VoxelGrid, Memory_GrowsWithTheSurface) {
  const Mesh ball = sphere_mesh(0.5, 3);
  const double small = double(grid_of(ball, 64000).bytes()), large = double(grid_of(ball, 512000).bytes());
  EXPECT_LT(large / small, 5);
  EXPECT_LT(large, 8e6);
}

// What near() says no to is never nearer than the limit within the way that the limit allows.
TEST(VoxelGrid, Near_NeverMissesWhatMayCome) {
  const Mesh box = cube();
  const VoxelGrid g = grid_of(box, 4000);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-1, 1);
  int refused = 0;
  for (int i = 0; i < 200000; ++i) {
    const Vec3 p{0.1 + u(random), 0.2 + u(random), 0.3 + u(random)};
    const double limit = (i % 2 ? 0.5 : 4) * g.cell() * (1 + u(random)), way = limit * 0.5 * (1 + u(random));
    if (g.near(p, limit)) continue;
    ++refused;
    const Vec3 there = p + way * normalized(Vec3{u(random), u(random), u(random)});
    ASSERT_GE(g.at(there).distance, limit - way) << i;
  }
  EXPECT_GT(refused, 20000);
}

// Beside the grid the distance is what is certain: never more than the truth, never a contact
// that is not there.
TEST(VoxelGrid, Outside_UnderestimatesAndGrows) {
  const Mesh box = cube();
  const VoxelGrid g = grid_of(box, 4000);
  for (double x = 1; x < 5; x += 0.3) {
    const Vec3 p{x, 0.5 * x, 0.3};
    const double want = true_distance(box, p, false), got = g.at(p).distance;
    EXPECT_LE(got, want + g.cell());
    if (x > 1.5) {
      EXPECT_GT(got, 0.3 * want);
    }
  }
  EXPECT_TRUE(std::isfinite(g.at({NAN, 0, 0}).gradient.x));
}

TEST(VoxelGrid, BoxWithoutHeight_StaysWithinItsCells) {
  for (const double height : {1e-2, 1e-6, 1e-12}) {
    const VoxelGrid grid = grid_of(box_mesh({1, 1, height}, 1, 1, 1), 4096);
    EXPECT_LT(grid.bytes(), (512u + 2048u) * (VoxelGrid::kNodes + 10) * sizeof(float)) << height;
  }
}
