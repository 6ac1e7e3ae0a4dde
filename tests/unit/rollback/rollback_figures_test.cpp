// What the roll-back does to sliding, momentum and force, beside the library's step: the figures of
// doc/concepts/rollback.md (rollback_bench prints them in full). These are errors of the scheme, not of its
// implementation: the tests of (4.5) in doc/reference/zerbato.md, which it has to fail.
#include "rollback_cases.h"

namespace {

namespace rb = test::rollback;
constexpr rb::By kLibrary = rb::By::library, kRollback = rb::By::rollback;
constexpr double kStep = 1e-3;

}  // namespace

// A frictionless block on 30 degrees: g sin 30 = 4.905 m/s2.
TEST(Rollback, FrictionlessSlope_Freezes) {
  const rb::Slide v = rb::incline(kLibrary, 30, 0, kStep), r = rb::incline(kRollback, 30, 0, kStep);
  std::printf("acceleration %.4f by the library, %.4f by rollback; way %.3e and %.3e m\n", v.acceleration,
              r.acceleration, v.way, r.way);
  EXPECT_NEAR(v.acceleration, rb::kG * 0.5, 0.01);
  EXPECT_LT(std::fabs(r.way), 1e-5);
  EXPECT_NEAR(r.reported, 1, 0.02)
      << "at rest on something that cannot move the corrected normal force is right";
}

// Thrown along a floor: the way is v^2 / (2 mu g), so half as long for twice the friction. The roll-back's
// does not know of friction.
TEST(Rollback, WayOfASlidingBlock_DoesNotDependOnFriction) {
  const double way[] = {rb::thrown(kRollback, 1, 0.3, kStep).way, rb::thrown(kRollback, 1, 0.6, kStep).way};
  std::printf("way %.4f m at mu 0.3, %.4f m at 0.6; exact %.4f and %.4f\n", way[0], way[1],
              1 / (0.6 * rb::kG), 1 / (1.2 * rb::kG));
  EXPECT_NEAR(way[1], way[0], 0.02 * way[0]);
  EXPECT_NEAR(rb::thrown(kLibrary, 1, 0.3, kStep).way, 1 / (0.6 * rb::kG), 2e-3);
  EXPECT_NEAR(rb::thrown(kLibrary, 1, 0.6, kStep).way, 1 / (1.2 * rb::kG), 2e-3);
}

// Frictionless and oblique: the speed along the floor must stay.
TEST(Rollback, ObliqueBounce_LosesSpeedAlongTheFloor) {
  const rb::Bounce v = rb::bounce(kLibrary, {1, 0, -1}, 0, kStep);
  const rb::Bounce r = rb::bounce(kRollback, {1, 0, -1}, 0, kStep);
  std::printf("speed along the floor after the bounce %.4f by the library, %.4f by rollback\n", v.velocity[0],
              r.velocity[0]);
  EXPECT_NEAR(v.velocity[0], 1, 1e-9);
  EXPECT_LT(r.velocity[0], 0.7);
  EXPECT_GT(r.velocity[2], 0.5) << "straight up it does bounce";
}

// An isolated pair: what is flying at a body at rest bounces off it as off a wall. Smaller steps do not help.
TEST(Rollback, Collision_LosesAllMomentumAndMore) {
  const rb::Collision v = rb::collision(kLibrary, 1, kStep);
  EXPECT_NEAR(v.momentum, 1, 1e-12);
  for (const double h : {kStep, kStep / 4}) {
    const rb::Collision r = rb::collision(kRollback, 1, h);
    std::printf("h %g: momentum left %.4f of what was (library %.12f), struck body at %.2e m/s\n", h,
                r.momentum, v.momentum, r.second);
    EXPECT_LT(r.momentum, -0.2);
    EXPECT_LT(std::fabs(r.second), 1e-3);
  }
}

// A block on a block: what is frozen in between hangs in the air and hides the weight above it from
// what is below.
TEST(Rollback, NormalForceUnderAStack_Vanishes) {
  const rb::Stacked v = rb::stacked(kLibrary, kStep), r = rb::stacked(kRollback, kStep);
  std::printf("floor carries %.4f of the weight by the library, %.4f by rollback, whose bodies feel %.4f\n",
              v.floor_reported, r.floor_reported, r.floor_felt);
  EXPECT_NEAR(v.floor_reported, 1, 2e-3);
  EXPECT_NEAR(v.middle_reported, 1, 2e-3);
  EXPECT_LT(r.floor_reported, 0.4);
  EXPECT_NEAR(r.floor_felt, 1, 2e-2);
}
