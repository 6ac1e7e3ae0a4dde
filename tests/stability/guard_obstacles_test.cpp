// The guard's promise against what is no soft body: meshes that are closed, open and moving, voxels, and
// rigid bodies of a host.
#include <algorithm>

#include "shot.h"

namespace {

using test::Shot;
using test::ten_times;
using test::Vec;

void sheet_above(Shot &s, double speed, double above = 0.02) {
  s.add("beam", {0.12, 0.12, 0.012}, 30, {-0.06 + s.jitter(0.02), -0.06 + s.jitter(0.02), above},
        {0, 0, -speed}, {0.1 + s.jitter(0.05), s.jitter(0.1), s.jitter(0.3), 1});
}

void closed_mesh(Shot &s) {
  s.add_wall(test::box_surface({0.03, 0.05, 0.004}, 2));
  sheet_above(s, 100);
}
void terrain(Shot &s) {
  s.add_wall(test::height_field(
      0.2, 8, [](double x, double y) { return 0.03 * std::cos(25 * x) * std::cos(20 * y); }));
  s.add("ball", {0.05, 0, 0}, 100, {s.jitter(0.05), s.jitter(0.05), 0.09}, {s.jitter(5), s.jitter(5), -30},
        {0, 0, 0, 1}, 2e4);
}
// A blade that is swung through a block that stands in its way.
void blade(Shot &s) {
  const dfm_obstacle o = s.add_wall(test::box_surface({0.004, 0.06, 0.05}, 2));
  const double up = s.jitter(0.02), tilt = s.jitter(0.2);
  s.add("beam", {0.05, 0.05, 0.05}, 60, {0.03, -0.025 + s.jitter(0.02), -0.025}, {});
  s.before = [=](int step) {
    dfm_pose p{{0.05 * (step + 1), 0, up}, {0, tilt * (step + 1), 0, 1}};
    const double n = std::sqrt(1 + p.rotation[1] * p.rotation[1]);
    for (double &q : p.rotation) q /= n;
    test::ok(dfm_obstacle_move_to(o, &p));
  };
}
void rigid_slab(Shot &s) {
  s.add("beam", {0.12, 0.12, 0.012}, 30, {-0.06, -0.06, -0.02}, {});
  s.add_rigid_box({0.03, 0.01, 0.005}, 0.2, {s.jitter(0.04), s.jitter(0.04), 0.02}, {0, 0, -100},
                  {s.jitter(300), s.jitter(300), s.jitter(300)});
}
void rigid_struck(Shot &s) {  // it rests; what hits it moves it faster than its lists were made for
  s.add_rigid_box({0.04, 0.04, 0.003}, 0.01, {}, {});
  s.add("ball", {0.02, 0, 0}, 100, {s.jitter(0.02), s.jitter(0.02), 0.05}, {0, 0, -60});
  s.add("beam", {0.12, 0.12, 0.012}, 30, {-0.06 + s.jitter(0.02), -0.06, -0.03}, {});
}

}  // namespace

TEST(Guard, SheetOnClosedMeshAt100MetersPerSecond_NeverCross) { ten_times(closed_mesh, 2, 5e-4); }
TEST(Guard, SoftBallOnTerrainAt30MetersPerSecond_NeverCross) { ten_times(terrain, 4, 1e-3); }
TEST(Guard, BladeSwungThroughBlock_NeverCrosses) { ten_times(blade, 3, 1e-3); }
TEST(Guard, SpinningRigidSlabAt100MetersPerSecond_NeverCrossesSheet) { ten_times(rigid_slab, 2, 5e-4); }
TEST(Guard, RigidPlateStruck_NeverCrosses) { ten_times(rigid_struck, 3, 1e-3); }

// Voxels round off what is below a cell, so crossings with the triangles they came from say little: their
// face may lie half a cell below the true one. What hangs over an edge swings under the wall, by 4 mm in this
// time: 10 mm from the edges no surfel is behind the upper face. Without the guard some are.
TEST(Guard, SoftSheetAgainstVoxelsAt90MetersPerSecond_StaysOnItsSide) {
  const Vec half{0.06, 0.06, 0.004};
  const uint32_t cells = 20000;
  const double cell = std::cbrt(8 * half[0] * half[1] * half[2] / cells);
  size_t behind[2] = {0, 0};
  for (unsigned seed = 1; seed <= 12; ++seed)
    for (const bool guarded : {false, true}) {
      Shot s(guarded, seed);
      test::add_mesh(s.world, "wall", test::box_surface(half, 2), DFM_SHAPE_VOXELS, cells);
      const Vec at{s.jitter(0.02) - 0.01, s.jitter(0.02) - 0.01, 0.03};
      const Vec velocity{s.jitter(18), s.jitter(18), -90};
      s.add("beam", {0.06, 0.06, 0.006}, 60, at, velocity, {0, 0.1, 0, 0.995}, 3e4);
      for (int step = 0; step < 4; ++step) {
        EXPECT_TRUE(test::run(s, 1, 2.5e-4).finite);
        const std::vector<double> x = test::surface_positions(s.bodies[0]);
        for (size_t i = 0; i < x.size(); i += 3)
          behind[guarded] += std::fabs(x[i]) < half[0] - 0.01 && std::fabs(x[i + 1]) < half[1] - 0.01 &&
                             x[i + 2] < half[2] - 0.5 * cell;
      }
    }
  EXPECT_EQ(behind[true], 0u);  // the deepest one stays 0.01 mm above the face
  EXPECT_GT(behind[false], 0u) << "the case needs no guard";
}

TEST(Guard, RigidAndSoft_KeepMomentum) {
  for (const auto &setup : {rigid_slab, rigid_struck}) {
    Shot s(true, 3);
    setup(s);
    double scale = 0;
    const Vec before = s.momentum(&scale);
    const test::Outcome out = test::run(s, 3, 5e-4);
    EXPECT_GT(out.steps, 0u);
    const Vec after = s.momentum();
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(after[k], before[k], 1e-12 * scale);
  }
}

// A contact that the guard has given several rows is one: its key comes once, and the impulses of all its
// rows are in the report.
TEST(Guard, RowsOfHits_AreReportedAsOneContact) {
  uint64_t solves = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    Shot s(true, seed);
    seed % 2 ? closed_mesh(s) : terrain(s);
    for (int step = 0; step < 4; ++step) {
      double scale = 0;
      const Vec start = s.momentum(&scale);
      test::ok(dfm_world_step(s.world, 5e-4, nullptr));
      const Vec end = s.momentum();
      Vec given{};
      for (const dfm_pair_impulse &p : test::listed(dfm_world_pair_impulses, s.world))
        for (size_t k = 0; k < 3; ++k) given[k] += p.impulse[k];
      for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(given[k], end[k] - start[k], 1e-9 * scale) << seed;
      std::vector<uint64_t> keys;
      for (const dfm_contact &c : test::contacts(s.world)) keys.push_back(c.key);
      std::sort(keys.begin(), keys.end());
      EXPECT_EQ(std::adjacent_find(keys.begin(), keys.end()), keys.end()) << seed;
    }
    solves += test::stats(s.world).guard_solves;
  }
  EXPECT_GT(solves, 10u);
}
