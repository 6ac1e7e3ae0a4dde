// The guard's promise: at the end of no step do bodies cross, however fast they are. Each scene runs ten
// times with jitter, and crosses without the guard.
#include "shot.h"

namespace {

using test::Outcome;
using test::run;
using test::ten_times;
using test::Vec;
using Scene = test::Shot;

void sheets(Scene &s) {
  s.add("beam", {0.12, 0.12, 0.012}, 30, {}, {});
  s.add("beam", {0.12, 0.12, 0.012}, 30, {s.jitter(0.02), s.jitter(0.02), 0.03}, {0, 0, -100},
        {0.1 + s.jitter(0.05), s.jitter(0.1), s.jitter(0.3), 1});
}
void sheet_and_box(Scene &s) {
  s.add("beam", {0.05, 0.05, 0.05}, 40, {0.03, 0.03, -0.06}, {});
  s.add("beam", {0.12, 0.12, 0.012}, 50, {s.jitter(0.02), s.jitter(0.02), 0.04}, {0, 0, -100},
        {s.jitter(0.1), 0.1 + s.jitter(0.05), s.jitter(0.3), 1});
}
void gap(Scene &s) {  // 30 mm wide, for a ball of 36 mm; soft enough to cross where nothing guards them
  s.add("beam", {0.1, 0.1, 0.02}, 100, {-0.115, -0.05, 0}, {}, {0, 0, 0, 1}, 3e5);
  s.add("beam", {0.1, 0.1, 0.02}, 100, {0.015, -0.05, 0}, {}, {0, 0, 0, 1}, 3e5);
  s.add("ball", {0.018, 0, 0}, 100, {s.jitter(0.005), s.jitter(0.02), 0.05}, {0, 0, -40}, {0, 0, 0, 1}, 3e5);
}
void spike_on_wedge(Scene &s) {  // a corner comes down on an edge
  s.add("beam", {0.08, 0.2, 0.08}, 60, {-0.0566, -0.1, 0}, {}, {0, 0.3827, 0, 0.9239});
  s.add("beam", {0.06, 0.06, 0.06}, 60, {s.jitter(0.01), s.jitter(0.03), 0.09},
        {s.jitter(2), s.jitter(2), -80}, {0.3251, -0.3251, 0, 0.8881});
}
void pile(Scene &s) {
  test::add_plane(s.world, "floor", {0, 0, -0.005});
  for (int i = 0; i < 4; ++i)
    s.add("beam", {0.1, 0.04, 0.02}, 24, {s.jitter(0.02), s.jitter(0.02), 0.03 * i}, {0, 0, -8.0 - 6 * i},
          {0, 0, s.jitter(0.5), 1});
}

}  // namespace

TEST(Guard, SheetOnSheetAt100MetersPerSecondJittered1To3_NeverCross) { ten_times(sheets, 2, 5e-4, 1, 3); }
TEST(Guard, SheetOnSheetAt100MetersPerSecondJittered4To6_NeverCross) { ten_times(sheets, 2, 5e-4, 4, 6); }
TEST(Guard, SheetOnSheetAt100MetersPerSecondJittered7To10_NeverCross) { ten_times(sheets, 2, 5e-4, 7, 10); }
TEST(Guard, SheetOnBlockAt100MetersPerSecond_NeverCross) { ten_times(sheet_and_box, 3, 5e-4); }
TEST(Guard, BallThroughNarrowGap_NeverCrosses) { ten_times(gap, 3, 1e-3); }
TEST(Guard, CornerOnEdge_NeverCross) { ten_times(spike_on_wedge, 4, 1e-3); }
TEST(Guard, PileDroppedHard_NeverCrosses) { ten_times(pile, 3, 1e-3); }

// A sheet that would be beyond a box obstacle after one sub-step stays outside it, and the momentum that the
// box takes is in the report.
TEST(Guard, SheetOnBoxObstacle_StaysOutside) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Scene s(true, seed);
    dfm_obstacle_def box = dfm_obstacle_def_default();
    box.name = "box";
    box.shape = DFM_SHAPE_BOX;
    box.pose.position[2] = -0.01;
    box.half_size[0] = box.half_size[1] = 0.05;
    box.half_size[2] = 0.002;
    dfm_obstacle obstacle = 0;
    test::ok(dfm_obstacle_create(s.world, &box, &obstacle));
    s.add("beam", {0.12, 0.12, 0.012}, 50, {-0.06 + s.jitter(0.02), -0.06 + s.jitter(0.02), 0.02},
          {0, 0, -100}, {0.1, s.jitter(0.1), 0, 1});
    EXPECT_TRUE(run(s, 3, 5e-4).finite);
    for (const dfm_body b : s.bodies) {
      const std::vector<double> x = test::surface_positions(b);
      for (size_t i = 0; i < x.size(); i += 3)
        EXPECT_FALSE(std::fabs(x[i]) < 0.05 && std::fabs(x[i + 1]) < 0.05 &&
                     std::fabs(x[i + 2] + 0.01) < 0.002)
            << "seed " << seed << " inside";
    }
  }
}

TEST(Guard, TwoBodies_KeepMomentum) {
  uint64_t acted = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Scene s(true, seed);
    sheets(s);
    double scale = 0;
    const Vec before = s.momentum(&scale);
    acted += run(s, 3, 5e-4).steps;
    const Vec after = s.momentum();
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(after[k], before[k], 1e-12 * scale) << seed;
  }
  EXPECT_GT(acted, 0u);
}

TEST(Guard, ThreadsAndRepetition_SameHash) {
  uint64_t hash[3];
  for (int i = 0; i < 3; ++i) {
    Scene s(true, 5, i == 2 ? 4 : 1);
    spike_on_wedge(s);
    EXPECT_GT(run(s, 3, 1e-3).steps, 0u);
    hash[i] = dfm_world_hash(s.world);
  }
  EXPECT_EQ(hash[0], hash[1]);
  EXPECT_EQ(hash[0], hash[2]);
}

// The guard's memory of a pair is valid for the motion of steps only. Two runs begin apart, one so far
// that its pairs are not listed; both are then given the same state by dfm_body_set_state(), from which
// they go on alike.
TEST(Guard, StateSetBetweenSteps_ForgetsHowFarApartPairsWere) {
  for (const double speed : {20.0, 60.0, 100.0}) {
    uint64_t acted[2];
    std::vector<double> ends[2];
    for (const bool listed : {false, true}) {
      Scene s(true, 2);
      s.add("beam", {0.12, 0.12, 0.012}, 30, {}, {});
      s.add("beam", {0.12, 0.12, 0.012}, 30, {0.01, 0.01, 0}, {}, {0.02, 0.01, 0.2, 1});
      const std::vector<double> lower = test::points(s.bodies[0]), upper = test::points(s.bodies[1]);
      const std::vector<double> still(lower.size());
      const auto put = [&](double up, double velocity) {
        std::vector<double> x = upper, v(x.size());
        for (size_t i = 2; i < x.size(); i += 3) {
          x[i] += up;
          v[i] = velocity;
        }
        test::ok(dfm_body_set_state(s.bodies[0], uint32_t(lower.size() / 3), lower.data(), still.data()));
        test::ok(dfm_body_set_state(s.bodies[1], uint32_t(x.size() / 3), x.data(), v.data()));
      };
      put(listed ? 0.03 : 10, 40);
      EXPECT_TRUE(run(s, 1, 1e-4).finite);
      put(0.018, -speed);
      const Outcome out = run(s, 3, 5e-4);
      EXPECT_EQ(out.crossed, 0u) << speed << " m/s";
      acted[listed] = out.steps;
      ends[listed] = test::points(s.bodies[1]);
    }
    EXPECT_GT(acted[0], 0u) << speed << " m/s: the case needs no guard";
    EXPECT_EQ(acted[0], acted[1]) << speed << " m/s";
    EXPECT_EQ(ends[0], ends[1]) << speed << " m/s";
  }
}

// Rest and sliding are the contact solve's business: the guard never acts, and the state has the same bits
// as without it.
TEST(Guard, RestAndSliding_NeverTrip) {
  uint64_t hash[2];
  for (const bool guarded : {true, false}) {
    Scene s(guarded, 1);
    const double g[3] = {0, 0, -9.81};
    test::ok(dfm_world_set_gravity(s.world, g));
    test::add_plane(s.world, "floor");
    s.add("beam", {0.2, 0.2, 0.05}, 60, {0, 0, 1e-5}, {});
    s.add("beam", {0.06, 0.06, 0.04}, 20, {0.02, 0.07, 0.0501}, {0.6, 0.1, 0});
    EXPECT_TRUE(run(s, 300, 1e-3).finite);
    EXPECT_EQ(test::stats(s.world).guard_steps, 0u);
    EXPECT_GT(test::stats(s.world).contacts_max, 8u);
    hash[guarded] = dfm_world_hash(s.world);
  }
  EXPECT_EQ(hash[0], hash[1]);
}
