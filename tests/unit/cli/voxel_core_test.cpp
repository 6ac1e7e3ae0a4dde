// What of a voxel obstacle the crossing check counts: its mesh drawn in by half a cell.
#include "voxel_core.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace {

// A box about the origin, two triangles a side.
struct Box {
  std::vector<double> points;
  std::vector<uint32_t> triangles;
  dfm_obstacle_def def = {};
  Box(double x, double y, double z, uint32_t cells) {
    for (int i = 0; i < 8; ++i) points.insert(points.end(), {i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z});
    for (const auto &q : {std::array<uint32_t, 4>{0, 2, 3, 1},
                          {4, 5, 7, 6},
                          {0, 1, 5, 4},
                          {2, 6, 7, 3},
                          {0, 4, 6, 2},
                          {1, 3, 7, 5}})
      triangles.insert(triangles.end(), {q[0], q[1], q[2], q[0], q[2], q[3]});
    def.npoint = 8;
    def.ntriangle = 12;
    def.cells = cells;
    def.points = points.data();
    def.triangles = triangles.data();
  }
};

}  // namespace

TEST(VoxelCore, Cell_FillsTheBox) {
  EXPECT_NEAR(cli::voxel_cell(Box(0.5, 0.5, 0.5, 1000).def), 0.1, 1e-12);
  EXPECT_NEAR(cli::voxel_cell(Box(1, 0.5, 0.25, 0).def), std::cbrt(1.0 / 262144), 1e-12);
}

// Also at corners, where the sides have one triangle or two.
TEST(VoxelCore, Box_IsSmallerByHalfACellOnEverySide) {
  const Box box(0.5, 0.4, 0.3, 480);
  const double cell = cli::voxel_cell(box.def);
  EXPECT_NEAR(cell, 0.1, 1e-12);
  const std::vector<double> core = cli::voxel_core(box.def);
  ASSERT_EQ(core.size(), 24u);
  for (size_t i = 0; i < core.size(); ++i)
    EXPECT_NEAR(core[i], box.points[i] * (1 - 0.05 / std::fabs(box.points[i])), 1e-12);
}

// No point moves by more than a cell, however sharp the surface: here a sheet of two sides.
TEST(VoxelCore, Sheet_MovesByACellAtMost) {
  Box box(0.5, 0.5, 1e-9, 1000);
  const double cell = cli::voxel_cell(box.def);
  const std::vector<double> core = cli::voxel_core(box.def);
  for (size_t p = 0; p < 8; ++p) {
    double moved = 0;
    for (size_t i = 0; i < 3; ++i)
      moved += (core[3 * p + i] - box.points[3 * p + i]) * (core[3 * p + i] - box.points[3 * p + i]);
    EXPECT_LE(std::sqrt(moved), cell * (1 + 1e-12));
    EXPECT_TRUE(std::isfinite(moved));
  }
}
