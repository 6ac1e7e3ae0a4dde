// A block thrown along a floor, a ball that bounces without friction, two balls that collide: closed
// forms that hold for `deform run`, and `deform rollback`, Zerbato's scheme, as the mutation that fails every
// one of them.
#include "scenes.h"

namespace {

// Each from where and how it starts, which jitter changes.
bool slides(const test::SceneRun &run) {  // v^2 / (2 mu g), 0.2446 m for 1.2 m/s
  const auto rows = run.rows("thrown");
  const double v = rows.front().velocity[0];
  return std::fabs(rows.back().com[0] - rows.front().com[0] - v * v / (2 * 0.3 * 9.81)) < 0.005;
}
bool bounces(const test::SceneRun &run) {
  return std::fabs(run.last("bouncing").velocity[0] - run.rows("bouncing").front().velocity[0]) < 1e-9;
}
bool collides(const test::SceneRun &run) {  // masses are alike
  const test::BodyRow from[] = {run.rows("flying").front(), run.rows("struck").front()};
  const test::BodyRow to[] = {run.last("flying"), run.last("struck")};
  return std::fabs(to[0].velocity[0] + to[1].velocity[0] - from[0].velocity[0] - from[1].velocity[0]) <
             1e-9 &&
         to[1].velocity[0] > 0.8;
}

}  // namespace

TEST(RollbackCompare, Run_MeetsTheClosedForms) {
  const test::SceneRun run("rollback_compare", {});
  run.expect_valid(15, "run");
  EXPECT_TRUE(slides(run));
  EXPECT_TRUE(bounces(run));
  EXPECT_TRUE(collides(run));
}

TEST(RollbackCompare, Rollback_FailsEachOfThem) {
  const test::SceneRun run("rollback_compare", {}, "rollback");
  run.expect_valid(15, "rollback");
  EXPECT_FALSE(slides(run));
  EXPECT_FALSE(bounces(run));
  EXPECT_FALSE(collides(run));
  EXPECT_LT(run.last("bouncing").velocity[0], 0.8);
  EXPECT_LT(run.last("flying").velocity[0] + run.last("struck").velocity[0], 0) << "momentum has turned over";
}

TEST(RollbackCompare, JitteredRuns_MeetTheClosedForms) {
  test::expect_jittered("rollback_compare", 1, 10, {}, 15, [](const test::SceneRun &run) {
    return slides(run) && bounces(run) && collides(run);
  });
}
