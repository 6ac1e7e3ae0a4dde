// A ring pressed flat between two plates until its walls meet, the plates drawn apart sideways, and let go.
#include "scenes.h"

namespace {

// Height of the ring's hole, m, in record i of two probes.
double hole(const test::SceneRun &run, size_t i) {
  return run.probe_rows("roof")[i][3] - run.probe_rows("ground")[i][3];
}

double least_hole(const test::SceneRun &run) {
  double least = 1;
  for (size_t i = 0; i < run.probe_rows("roof").size(); ++i) least = std::min(least, hole(run, i));
  return least;
}
bool walls_meet(const test::SceneRun &run) { return least_hole(run) > 0 && least_hole(run) < 1e-3; }
bool opens_again(const test::SceneRun &run) {
  return hole(run, run.probe_rows("roof").size() - 1) > 0.9 * hole(run, 0);
}

const std::vector<std::string> kPressed = {"--time", "0.6"};

}  // namespace

TEST(PressedRing, WallsMeet_CarryAndPart) {
  const test::SceneRun run("pressed_ring", {"--set", "/output/every=0.01"});
  run.expect_valid(20, "ring");
  EXPECT_EQ(run.number("intersections_self_max"), 0);
  EXPECT_TRUE(walls_meet(run)) << "their distance, m: " << least_hole(run);
  EXPECT_TRUE(opens_again(run));
}

TEST(PressedRing, WithoutTheEffect_Crosses) {
  const test::SceneRun run("pressed_ring", {"--time", "0.6", "--set", "/contact/self=false"});
  EXPECT_GT(run.number("intersections_self_max"), 10);
  EXPECT_EQ(run.number("intersections_between_max"), 0);
  EXPECT_EQ(run.number("intersections_max"), run.number("intersections_self_max"));
}

// soak: long, and a jittered run of what another test runs
TEST(PressedRing, JitteredRuns_DoNotCross) {
  test::expect_jittered("pressed_ring", 1, 10, kPressed, 20, walls_meet);
}
