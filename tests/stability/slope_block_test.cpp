// A block on a slope that tilts to 26.5 degrees within 1.6 s (gravity turns): tan 26.5 degrees = 0.4986, so
// 0.5 holds and 0.49 does not.
#include "scenes.h"

namespace {

const std::vector<std::string> kSlippery = {"--set", "/contact/friction/0/params/mu=0.49"};

// No motion down the slope once the ramp is over, at t = 1.8 s; a slide at 0.49 makes 0.2 m.
bool holds(const test::SceneRun &run) {
  const auto rows = run.rows("block");
  double moved = 0;
  for (const test::BodyRow &row : rows)
    if (row.t > 2)
      moved = std::max(moved, std::hypot(row.com[0] - rows.back().com[0], row.com[1] - rows.back().com[1]));
  return moved < 1e-6 && run.creep_um_per_s() < 1;
}

}  // namespace

TEST(SlopeBlock, FrictionOneHalf_HoldsWithoutCreep) {
  const test::SceneRun run("slope_block", {});
  run.expect_valid(10, "mu 0.5");
  EXPECT_TRUE(holds(run));
  EXPECT_EQ(run.number("unconverged_steps"), 0);
}

TEST(SlopeBlock, FrictionZeroPointFourNine_Slides) {
  const test::SceneRun run("slope_block", kSlippery);
  run.expect_valid(10, "mu 0.49");
  EXPECT_FALSE(holds(run));
  // g (sin - 0.49 cos) = 0.0753 m/s2 over the 2.2 s after the ramp, and a little before its end
  EXPECT_NEAR(run.last("block").com[0], 0.5 * 0.0753 * 2.2 * 2.2, 0.03);
}

TEST(SlopeBlock, JitteredRuns_AllHold) { test::expect_jittered("slope_block", 1, 10, {}, 10, holds); }
