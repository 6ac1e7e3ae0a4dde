// Balls, bars and rods of three stiffnesses dropped into a box: they pile up, come to rest and never cross.
#include "scenes.h"

namespace {

const char *const kBodies[] = {"ball1", "ball2", "ball3", "ball4", "bar1",
                               "bar2",  "bar3",  "rod1",  "rod2",  "rod3"};

bool inside_the_box(const test::SceneRun &run) {
  bool inside = true;
  for (const char *body : kBodies) {
    const test::BodyRow row = run.last(body);
    inside = inside && std::fabs(row.com[0]) < 0.32 && std::fabs(row.com[1]) < 0.32 && row.com[2] > 0.03 &&
             row.com[2] < 2.0;
  }
  return inside;
}

bool apart(const test::SceneRun &run) { return run.number("intersections_max") == 0; }

}  // namespace

// soak: long; FillDrop.OrgansAndRabbits has the same criteria, and the landing is in scene_table_test
TEST(TenBodies, DroppedInABox_ComeToRestWithoutCrossing) {
  // When the last bar has fallen over differs by a second between starts that differ by rounding.
  const test::SceneRun run("ten_bodies", {"--time", "5"});
  run.expect_valid(100, "ten bodies");
  EXPECT_TRUE(apart(run));
  EXPECT_TRUE(inside_the_box(run));
  EXPECT_LT(run.creep_um_per_s(), 1);
  double kinetic = 0;
  for (const char *body : kBodies) kinetic += run.last(body).kinetic;
  EXPECT_LT(kinetic, 1e-2) << "joule; the drop is worth 300";
}

TEST(TenBodies, TwoKindsThatMayPass_Cross) {
  const test::SceneRun run(
      "ten_bodies",
      {"--time", "0.8", "--set", R"(/contact/filter=[{"between": ["material=jelly", "material=gel"]}])"});
  EXPECT_FALSE(apart(run)) << "the crossing check must see what contact is told to ignore";
}

// Over the landing, where bodies hit hardest, checked every 10 ms.
const std::vector<std::string> kLanding = {"--time", "0.9", "--set", "/output/every=0.01"};
// soak: long, and a jittered run of what another test runs
TEST(TenBodies, JitteredRuns_DoNotCross) {
  test::expect_jittered("ten_bodies", 1, 10, kLanding, 60, inside_the_box);
}
