// Rigid bodies in scenes: a ball carries a box, a box lands on a bed, two plates pinch a ball and lift it.
#include "scenes.h"

namespace {

constexpr double kG = 9.81;

// The box hangs in the air no longer and lies still, where 2 kg lie.
bool carried(const test::SceneRun &run) {
  const test::BodyRow box = run.last("box");
  return std::fabs(run.contact_force("box") - 2 * kG) < 0.05 * 2 * kG && std::fabs(box.velocity[2]) < 0.01 &&
         box.com[2] > 0.15;
}

// Flat on the bed, which is 0.1 m high and 0.04 m below the box's middle.
bool landed(const test::SceneRun &run) {
  const test::BodyRow box = run.last("box");
  return std::fabs(run.contact_force("box") - 0.4 * kG) < 0.05 * 0.4 * kG && box.com[2] > 0.105 &&
         box.com[2] < 0.13 && box.kinetic < 1e-4;
}

// The ball goes up with the plates. Its slip against them per second over the last second, in the
// plates' frame.
double slip(const test::SceneRun &run) {
  const auto ball = run.rows("ball"), plate = run.rows("left");
  double first = 0, t0 = 0;
  for (size_t i = 0; i < ball.size(); ++i)
    if (ball[i].t > 2 && t0 == 0) {
      first = ball[i].com[2] - plate[i].com[2];
      t0 = ball[i].t;
    }
  return std::fabs(ball.back().com[2] - plate.back().com[2] - first) / (ball.back().t - t0);
}
bool lifted(const test::SceneRun &run) {
  return run.last("ball").com[2] > 0.2 && slip(run) < 1e-4 && run.last("left").com[2] > 0.24;
}

}  // namespace

TEST(RigidOnBall, Box_IsCarried) {
  const test::SceneRun run("rigid_on_ball", {});
  run.expect_valid(10, "box on ball");
  EXPECT_TRUE(carried(run));
  const test::SceneRun apart(
      "rigid_on_ball", {"--set", R"(/contact/filter=[{"between": ["ball", "box"], "collide": false}])"});
  EXPECT_FALSE(carried(apart));
}
// soak: long, and a jittered run of what another test runs
TEST(RigidOnBall, JitteredRuns_AllCarry) { test::expect_jittered("rigid_on_ball", 1, 10, {}, 10, carried); }

TEST(RigidOnBed, Box_LandsAndRests) {
  const test::SceneRun run("rigid_on_bed", {});
  run.expect_valid(5, "box on bed");
  EXPECT_TRUE(landed(run));
  const test::SceneRun pushed("rigid_on_bed", {"--set", "/rigid/bodies/0/velocity=[0.8,0,0]"});
  EXPECT_FALSE(landed(pushed));
}
// A stack whose load goes through a light box: its three motions are one problem. Explicit steps, and long
// implicit ones.
TEST(RigidOnBed, StackOfBoxes_Rests) {
  for (const char *const step : {"0.001", "0.016666666666666666"})
    for (const auto &[low, high] : {std::pair(1.0, 1.0), std::pair(0.05, 10.0)}) {
      SCOPED_TRACE(std::string(step) + " " + std::to_string(low) + " kg below " + std::to_string(high));
      const auto box = [](const char *name, double mass, double z) {
        return R"({"name": ")" + std::string(name) +
               R"(", "shape": "box", "half_size": [0.03, 0.03, 0.02], )" + R"("mass": )" +
               std::to_string(mass) + R"(, "pose": {"position": [0.05, 0.05, )" + std::to_string(z) + "]}}";
      };
      const test::SceneRun run(
          "rigid_on_bed",
          {"--set", std::string("/time/step=") + step, "--set", "/time/duration=1", "--set",
           "/materials/foam/young=1e6", "--set",
           "/rigid/bodies=[" + box("low", low, 0.1215) + ", " + box("high", high, 0.163) + "]"});
      run.expect_valid(10, "stack on bed");
      const test::BodyRow below = run.last("low"), above = run.last("high");
      EXPECT_NEAR(above.com[2] - below.com[2], 0.04, 1e-4);
      EXPECT_GT(below.com[2], 0.119);
      const double weight = (low + 2 * high) * kG;  // "low" carries both, and bears the upper one
      EXPECT_NEAR(run.contact_force("low"), weight, 0.01 * weight);
      EXPECT_LT(above.kinetic, 1e-6);
      EXPECT_EQ(run.number("unconverged_steps"), 0);
    }
}
TEST(RigidOnBed, JitteredRuns_AllLand) { test::expect_jittered("rigid_on_bed", 1, 10, {}, 5, landed); }

TEST(RigidPinch, Ball_IsLifted) {
  const test::SceneRun run("rigid_pinch", {});
  run.expect_valid(20, "pinch");
  EXPECT_TRUE(lifted(run));
  std::printf("  slip of the ball against the plates: %.3g m/s\n", slip(run));
}
TEST(RigidPinch, WithoutFrictionOrForce_NothingIsLifted) {
  EXPECT_FALSE(lifted(test::SceneRun("rigid_pinch", {"--set", test::kFrictionless})));
  EXPECT_FALSE(lifted(test::SceneRun("rigid_pinch", {"--set", "/rigid/bodies/1/joints/0/motor/max=20"})));
}
// soak: long, and a jittered run of what another test runs
TEST(RigidPinch, JitteredRuns_AllLift) { test::expect_jittered("rigid_pinch", 1, 10, {}, 20, lifted); }
