// Closed surfaces, filled as the scene is read, dropped on a floor, into a corner, on each other.
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
  run.expect_valid(50, "filled bodies");
  EXPECT_TRUE(in_the_corner(run));
  // in an impact loads rise beyond those that depths open against: 10 to 25 times in 10,600 sub-steps by the
  // last bits of the start
  EXPECT_LE(run.number("guard_steps"), 5e-3 * run.number("substeps"));
  double kinetic = 0;
  for (const char *body : kBodies) {
    kinetic += run.last(body).kinetic;
    EXPECT_NEAR(run.last(body).volume, run.rows(body).front().volume, 0.02 * run.last(body).volume) << body;
  }
  EXPECT_LT(kinetic, 5e-3) << "joule; the drop is worth 10";
}

TEST(FillDrop, BodiesThatMayPass_Cross) {
  const test::SceneRun run(
      "fill_drop",
      {"--time", "0.4", "--set", R"(/contact/filter=[{"between": ["*", "rabbit1"], "collide": false}])"});
  EXPECT_GT(run.number("intersections_max"), 0)
      << "the crossing check must see what contact is told to ignore";
}

// soak: long, and a jittered run of what another test runs
TEST(FillDrop, JitteredRuns_DoNotCross) {
  test::expect_jittered("fill_drop", 1, 10, kLanding, 30, in_the_corner);
}

// Ears first on an organ, under a second one: 50 pairs of an ear's triangles pass through each other where
// nothing keeps them from it.
const std::vector<std::string> kEars = {"--time", "0.4", "--set", "/output/every=0.01"};
bool not_folded(const test::SceneRun &run) {
  return run.number("intersections_self_max") == 0 && run.last("liver").com[2] > 0 &&
         run.last("rabbit").com[2] > 0;
}

// soak: long, and a jittered run of what another test runs
TEST(FillDropOrgans, JitteredRuns_DoNotCrossThemselves) {
  test::expect_jittered("fill_drop_organs", 1, 10, kEars, 30, not_folded);
}
TEST(FillDropOrgans, WithoutSelfContact_EarsFoldThroughThemselves) {
  std::vector<std::string> arguments = kEars;
  arguments.insert(arguments.end(), {"--set", "/contact/self=false"});
  EXPECT_FALSE(not_folded(test::SceneRun("fill_drop_organs", arguments)));
}
