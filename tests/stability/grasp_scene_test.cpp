// A grasper lifts a strip by friction alone.
#include "scenes.h"

namespace {

// With the hand, which goes up by 4 cm.
bool lifted(const test::SceneRun &run) {
  const std::vector<test::BodyRow> rows = run.rows("strip");
  return std::abs(rows.back().com[2] - rows[0].com[2] - 0.04) < 0.006;
}

}  // namespace

// soak: long, and a jittered run of what another test runs
TEST(Grasp, JitteredRuns_AllLift) {
  test::expect_jittered("grasp", 1, 10, {"--time", "1.6"}, 6, lifted);
  EXPECT_FALSE(
      lifted(test::SceneRun("grasp", {"--time", "1.6", "--set", "/contact/friction/0/params/mu=0.05"})));
}
