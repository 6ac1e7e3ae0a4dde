// A block on a slope that changes its model three times, explicit and implicit, under a law with memory.
#include "scenes.h"

namespace {

// It holds through the last half of the run, micrometers per second.
bool holds(const test::SceneRun &run) { return run.creep_um_per_s() < 1; }

}  // namespace

TEST(ChangingModels, BlockOnASlope_HoldsOn) {
  const test::SceneRun run("changing_models", {});
  run.expect_valid(12, "block");
  EXPECT_TRUE(holds(run)) << run.creep_um_per_s();
  EXPECT_EQ(run.number("gain_J", "energy"), 0);
  EXPECT_NEAR(run.number("t", "swaps"), 0.3, 1e-9);
  const double before = run.number("elastic_before_J", "swaps"), jump = run.number("jump_J", "swaps");
  EXPECT_GT(jump, 0) << "springs and cells are at rest in other shapes";
  EXPECT_LT(jump, 0.25 * before);
}

TEST(ChangingModels, TooLittleFriction_Slides) {
  const test::SceneRun run("changing_models", {"--set", "/contact/friction/0/params/mu=0.35"});
  EXPECT_GT(run.last("block").com[0], 0.15);
}

TEST(ChangingModels, ByARule_OnceItTouches) {
  const std::string rule = R"({"far": "msm", "touching": {"type": "corotational_fem",
                              "integrator": "implicit_euler"}})";
  const test::SceneRun run("changing_models", {"--time", "0.6", "--set", "/bodies/0/switch=" + rule});
  run.expect_valid(12, "block");
  EXPECT_GT(run.number("t", "swaps"), 0.01) << "it falls by 1.5 mm";
  EXPECT_LT(run.number("t", "swaps"), 0.03);
}

TEST(ChangingModels, JitteredRuns_Hold) { test::expect_jittered("changing_models", 1, 10, {}, 12, holds); }
