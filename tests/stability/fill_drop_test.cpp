// Closed surfaces, filled with cells as the scene is read, dropped on a floor, into a corner and on each other.
#include "scenes.h"

namespace {

const char *const kBodies[] = {"organ1", "rabbit1", "organ2", "rabbit2"};

bool in_the_corner(const test::SceneRun &run) {
  bool inside = true;
  for (const char *body : kBodies) {
    const test::BodyRow row = run.last(body);
    inside = inside && std::fabs(row.com[0]) < 0.15 && std::fabs(row.com[1]) < 0.15 && row.com[2] > 0.01;
  }
  return inside;
}

const std::vector<std::string> kLanding = {"--time", "0.4", "--set", "/output/every=0.01"};

}  // namespace

TEST(FillDrop, OrgansAndRabbits_ComeToRestWithoutCrossing) {
  const test::SceneRun run("fill_drop", {"--time", "1.6"});
  run.expect_sound(50, "filled bodies");
  EXPECT_TRUE(in_the_corner(run));
  EXPECT_EQ(run.number("guard_steps"), 0);
  double kinetic = 0;
  for (const char *body : kBodies) {
    kinetic += run.last(body).kinetic;
    EXPECT_NEAR(run.last(body).volume, run.rows(body).front().volume, 0.02 * run.last(body).volume) << body;
  }
  EXPECT_LT(kinetic, 5e-3) << "joule; the drop is worth 10";
}

TEST(FillDrop, BodiesThatMayPass_Cross) {
  const test::SceneRun run("fill_drop", {"--time", "0.4", "--set", R"(/contact/filter=[{"between": ["*", "rabbit1"], "collide": false}])"});
  EXPECT_GT(run.number("intersections_max"), 0) << "the crossing check must see what contact is told to ignore";
}

TEST(FillDrop, JitteredRuns1To3_DoNotCross) { test::expect_jittered("fill_drop", 1, 3, kLanding, 30, in_the_corner); }
TEST(FillDrop, JitteredRuns4To6_DoNotCross) { test::expect_jittered("fill_drop", 4, 6, kLanding, 30, in_the_corner); }
TEST(FillDrop, JitteredRuns7To8_DoNotCross) { test::expect_jittered("fill_drop", 7, 8, kLanding, 30, in_the_corner); }
TEST(FillDrop, JitteredRuns9To10_DoNotCross) { test::expect_jittered("fill_drop", 9, 10, kLanding, 30, in_the_corner); }

// Their ears and noses fold through themselves on impact where nothing keeps them from it.
void expect_livers_and_bunny(int from, int to) {
  if (test::shared_dir().empty()) GTEST_SKIP() << "../shared is not there";
  test::expect_jittered("fill_drop_organs", from, to, {"--time", "0.5", "--set", "/output/every=0.01"}, 30,
                        [](const test::SceneRun &run) { return run.number("intersections_self_max") == 0; });
}
TEST(FillDrop, LiversAndBunnyJittered1_DoNotCrossThemselves) { expect_livers_and_bunny(1, 1); }
TEST(FillDrop, LiversAndBunnyJittered2_DoNotCrossThemselves) { expect_livers_and_bunny(2, 2); }
TEST(FillDrop, LiversAndBunnyJittered3_DoNotCrossThemselves) { expect_livers_and_bunny(3, 3); }
TEST(FillDrop, LiversAndBunnyJittered4_DoNotCrossThemselves) { expect_livers_and_bunny(4, 4); }
TEST(FillDrop, LiversAndBunnyJittered5_DoNotCrossThemselves) { expect_livers_and_bunny(5, 5); }
TEST(FillDrop, LiversAndBunnyJittered6_DoNotCrossThemselves) { expect_livers_and_bunny(6, 6); }
TEST(FillDrop, LiversAndBunnyJittered7_DoNotCrossThemselves) { expect_livers_and_bunny(7, 7); }
TEST(FillDrop, LiversAndBunnyJittered8_DoNotCrossThemselves) { expect_livers_and_bunny(8, 8); }
TEST(FillDrop, LiversAndBunnyJittered9_DoNotCrossThemselves) { expect_livers_and_bunny(9, 9); }
TEST(FillDrop, LiversAndBunnyJittered10_DoNotCrossThemselves) { expect_livers_and_bunny(10, 10); }
