// When a surfel on a straight way first comes as near to voxels as the guard allows: against many samples
// of the same way.
#include <gtest/gtest.h>

#include <random>

#include "geometry/voxel_grid.h"
#include "obstacle.h"

TEST(VoxelTouch, RandomWays_FirstPlaceNotAboveTheLimit) {
  const test::Triangles box = test::box_surface({0.02, 0.03, 0.01}, 2);
  const dfm::VoxelGrid grid(dfm::Memory::standard(), box.points.data(), uint32_t(box.tris.size() / 3),
                            box.tris.data(), 4000);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-0.06, 0.06), limits(-1e-3, 1e-3);
  std::uniform_real_distribution<double> far(-6 * grid.cell(), 6 * grid.cell());
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const dfm::Vec3 from{place(random), place(random), place(random)};
    const dfm::Vec3 to{place(random), place(random), place(random)};
    const double limit = i % 2 ? limits(random) : far(random), t = grid.touch(from, to - from, limit);
    if (grid.at(from).distance <= limit) {
      EXPECT_EQ(t, 0) << i;
      continue;
    }
    constexpr int kSamples = 400;
    double first = HUGE_VAL;
    for (int k = 0; k <= kSamples && first > 1; ++k)
      if (grid.at(from + (double(k) / kSamples) * (to - from)).distance < limit) first = double(k) / kSamples;
    EXPECT_LE(t, first) << i << ": late";
    if (!(t <= 1)) continue;
    ++hits;
    if (limit > dfm::VoxelGrid::kBand * grid.cell()) continue;  // distances jump where bricks are not kept
    EXPECT_NEAR(grid.at(from + t * (to - from)).distance, limit, 1e-8) << i << ": not there";
  }
  EXPECT_GT(hits, 200);
}

// Every cell of the way would take a look: this would not end.
TEST(VoxelTouch, FromAfar_LooksWhereTheGridIs) {
  const test::Triangles box = test::box_surface({0.02, 0.03, 0.01}, 2);
  const dfm::VoxelGrid grid(dfm::Memory::standard(), box.points.data(), uint32_t(box.tris.size() / 3),
                            box.tris.data(), 4000);
  constexpr double kFar = 1e9;
  EXPECT_NEAR(kFar * grid.touch({-kFar, 0, 0}, {2 * kFar, 0, 0}, 1e-3), 0.5 * kFar, 0.1);
  EXPECT_EQ(grid.touch({-kFar, 1, 0}, {2 * kFar, 0, 0}, 1e-3), HUGE_VAL);
  EXPECT_EQ(grid.touch({0.1, 0, 0}, {kFar, kFar, 0}, 1e-3), HUGE_VAL);
}
