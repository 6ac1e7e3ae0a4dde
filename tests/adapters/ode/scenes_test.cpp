// Rigid bodies of ODE in scenes: a gripper lifts a ball, a seesaw comes to rest on a pad, a chain drags a ring; and the same rest as with the builtin host.
#include "scenes.h"

namespace {

double apart(const test::BodyRow &a, const test::BodyRow &b) { return std::hypot(a.com[0] - b.com[0], a.com[1] - b.com[1], a.com[2] - b.com[2]); }

// Scenes without contact between rigid bodies do not tell the hosts apart: 1 % of what the scene measures.
void expect_same_rest(const char *scene, const std::vector<std::string> &bodies, double size) {
  const test::SceneRun builtin(scene, {"--set", "/rigid/host=builtin"}), ode(scene, {"--set", "/rigid/host=ode"});
  for (const std::string &b : bodies) EXPECT_LT(apart(builtin.last(b), ode.last(b)), 0.01 * size) << b;
}

}  // namespace

TEST(OdeScenes, Seesaw_TipsOntoThePadAndRestsAsWithTheBuiltinHost) { expect_same_rest("ode_seesaw", {"light", "heavy", "pad", "plank"}, 0.1); }
TEST(OdeScenes, BoxOnBed_RestsAsWithTheBuiltinHost) { expect_same_rest("rigid_on_bed", {"bed", "box"}, 0.1); }

TEST(OdeScenes, GripperWithoutFriction_LiftsNothing) {
  const test::SceneRun run("ode_gripper", {"--time", "3", "--set", test::kFrictionless, "--set", "/rigid/bodies/0/joints/0/motor/velocity=0.1"});
  EXPECT_LT(run.last("ball").com[2], 0.15);
}
TEST(OdeScenes, Gripper_LiftsTheBallWithoutSlip) {
  const test::SceneRun run("ode_gripper", {"--time", "3"});
  run.expect_sound(20, "gripper");
  EXPECT_GT(run.last("palm").com[2], 0.374);
  EXPECT_GT(run.last("ball").com[2], 0.095);
  EXPECT_LT(run.number("creep_max_um_per_s", "hold"), 1);
}

TEST(OdeScenes, Chain_DragsTheRing) {
  const test::SceneRun run("ode_chain", {"--time", "1.5"});
  run.expect_sound(20, "chain");
  EXPECT_NEAR(run.last("lead").com[0], 0.42 + 0.15 * 1.5, 2e-3);
  EXPECT_GT(run.last("bag").com[0], 0.15);
}
