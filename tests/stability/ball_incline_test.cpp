// A ball on an incline of 10 degrees: frictionless it slides and does not turn; with friction it rolls, a =
// 5/7 g sin(theta), and twice the friction changes nothing. Gravity grows within 0.2 s, so that nothing
// rings. Source: reference/contact/tables/rolling_incline.csv.
#include "scenes.h"

namespace {

constexpr double kSlide = 1.70348862291, kRoll = 1.21677758779;  // accelerations, m/s2

// Mean acceleration after the start.
double acceleration(const test::SceneRun &run) {
  const auto rows = run.rows("ball");
  size_t first = 0;
  while (first + 1 < rows.size() && rows[first].t < 0.395) ++first;
  return (rows.back().velocity[0] - rows[first].velocity[0]) / (rows.back().t - rows[first].t);
}

// Largest component of angular velocity: angular momentum over 2/5 m r2.
double spin(const test::SceneRun &run) {
  double most = 0;
  for (const test::BodyRow &row : run.rows("ball"))
    for (double l : row.spin_momentum)
      most = std::max(most, std::fabs(l) / (0.4 * 1000 * row.volume * 0.1 * 0.1));
  return most;
}

// 5 %: the ball is a polyhedron of 720 facets and loses a little at every edge.
bool rolls(const test::SceneRun &run) {
  return std::fabs(acceleration(run) / kRoll - 1) < 0.05 && spin(run) > 8;
}

}  // namespace

TEST(BallIncline, Frictionless_SlidesWithoutTurning) {
  const test::SceneRun run("ball_incline", {"--set", test::kFrictionless});
  run.expect_valid(3, "frictionless");
  EXPECT_NEAR(acceleration(run), kSlide, 0.001 * kSlide);
  // It rocks on its facets by 1.0e-3 to 1.15e-3 rad/s, by the height that it is put down from.
  EXPECT_LT(spin(run), 1e-4 * 13) << "rad/s; rolling it would be 13";
  EXPECT_FALSE(rolls(run));
}

TEST(BallIncline, WithFriction_Rolls) {
  const test::SceneRun run("ball_incline", {});
  run.expect_valid(3, "mu 0.3");
  EXPECT_TRUE(rolls(run)) << acceleration(run) << " m/s2, " << spin(run) << " rad/s";
}

TEST(BallIncline, TwiceTheFriction_RollsTheSame) {
  const test::SceneRun once("ball_incline", {}),
      twice("ball_incline", {"--set", "/contact/friction/0/params/mu=0.6"});
  EXPECT_TRUE(rolls(twice));
  EXPECT_NEAR(acceleration(twice), acceleration(once), 0.05 * acceleration(once));
}

// tan(10 degrees) 2/7 = 0.0504: with less friction than that it slides and turns too slowly.
TEST(BallIncline, TooLittleFriction_DoesNotRoll) {
  const test::SceneRun run("ball_incline", {"--set", "/contact/friction/0/params/mu=0.02"});
  EXPECT_FALSE(rolls(run));
  EXPECT_NEAR(acceleration(run), 9.81 * (std::sin(0.174532925199) - 0.02 * std::cos(0.174532925199)),
              0.005 * kSlide);
}

// soak: long, and a jittered run of what another test runs
TEST(BallIncline, JitteredRuns_AllRoll) { test::expect_jittered("ball_incline", 1, 10, {}, 3, rolls); }

// Coarse balls and cylinders on 5 degrees, from rest: those with smooth surfaces go g sin / (1 + k) t^2 / 2,
// k = 2/5 and 1/2. On facets the ball stays behind, and the cylinder stays.
namespace {

bool rolls_smoothly(const test::SceneRun &run) {
  const double way = 0.5 * 0.855 * 1.6 * 1.6;
  return std::fabs(run.last("smooth_ball").com[0] / (way / 1.4) - 1) < 0.05 &&
         std::fabs(run.last("smooth_cylinder").com[0] / (way / 1.5) - 1) < 0.05;
}

}  // namespace

TEST(SmoothRolling, OnFacets_StaysBehind) {
  const test::SceneRun run("smooth_rolling", {});
  run.expect_valid(4, "smooth");
  EXPECT_TRUE(rolls_smoothly(run));
  EXPECT_LT(run.last("ball").com[0], 0.95 * run.last("smooth_ball").com[0]);
  EXPECT_LT(run.last("cylinder").com[0], 0.5 * run.last("smooth_cylinder").com[0]);
  EXPECT_FALSE(rolls_smoothly(
      test::SceneRun("smooth_rolling", {"--set", "/bodies/1/smooth=0", "--set", "/bodies/3/smooth=0"})));
  EXPECT_FALSE(rolls_smoothly(test::SceneRun("smooth_rolling", {"--set", test::kFrictionless})));
}

// soak: long, and a jittered run of what another test runs
TEST(SmoothRolling, JitteredRuns_AllRoll) {
  test::expect_jittered("smooth_rolling", 1, 10, {}, 4, rolls_smoothly);
}
