// Rigid bodies of an engine in scenes: a box lands on a bed, fingers lift a ball, a cart drives over a bump
// on its tyres, a chain drags a ring, weights tip a seesaw. Rigid bodies do not touch each other there, so
// the builtin host must bring the same as ODE and both builds of Bullet.
#include "scenes.h"

namespace {

using test::SceneRun;

constexpr double kG = 9.81;
constexpr const char *kNotBuilt = "built without libdeform_ode";

double apart(const test::BodyRow &a, const test::BodyRow &b) {
  return std::hypot(a.com[0] - b.com[0], a.com[1] - b.com[1], a.com[2] - b.com[2]);
}
double highest(const SceneRun &run, const char *body) {
  double z = -1e9;
  for (const test::BodyRow &row : run.rows(body)) z = std::max(z, row.com[2]);
  return z;
}
std::vector<std::string> lasting(double time, std::vector<std::string> settings = {}) {
  std::vector<std::string> arguments{"--time", std::to_string(time)};
  for (std::string &s : settings) arguments.insert(arguments.end(), {"--set", std::move(s)});
  return arguments;
}

// 1 % of what the scene measures: `size`.
void expect_as_builtin(const std::string &host, const char *scene, std::vector<std::string> arguments,
                       const std::vector<std::string> &bodies, double size) {
  arguments.insert(arguments.end(), {"--set", "/rigid/host=" + host});
  const SceneRun engine(scene, arguments);
  arguments.back() = "/rigid/host=builtin";
  const SceneRun builtin(scene, arguments);
  for (const std::string &b : bodies) EXPECT_LT(apart(builtin.last(b), engine.last(b)), 0.01 * size) << b;
  EXPECT_NE(engine.hash(), builtin.hash());
  engine.expect_valid(1, host);
}

class EngineScenes : public ::testing::TestWithParam<const char *> {
 protected:
  void SetUp() override {
    if (!test::has_host(GetParam())) GTEST_SKIP() << "built without host " << GetParam();
  }
  static std::string host() { return std::string("/rigid/host=") + GetParam(); }
};

// The box, of 15 kg, lies flat and still on the bed of 0.16 m and in it by no more than a tenth.
bool landed(const SceneRun &run) {
  const test::BodyRow box = run.last("box");
  return std::fabs(run.contact_force("box") - 15 * kG) < 0.05 * 15 * kG && box.com[2] > 0.224 &&
         box.com[2] < 0.24 && box.kinetic < 0.02;
}

// In the fingers, whose middle was at 0.11 m as the ball's at 0.1.
std::vector<std::string> lifting(std::vector<std::string> more = {}) {
  more.push_back("/rigid/bodies/0/joints/0/motor/velocity=0.05");
  return lasting(2, std::move(more));
}
bool lifted(const SceneRun &run) {
  return run.last("left").com[2] > 0.2 &&
         std::fabs(run.last("ball").com[2] - run.last("left").com[2] + 0.02) < 0.015;
}

// The front wheels have come up the bump, which begins 3 cm before them; every tyre is on its hub, the
// cart straight.
bool drives(const SceneRun &run) {
  bool on = run.last("chassis").com[0] > 0.18 && highest(run, "hub_front_left") > 0.17 &&
            std::fabs(run.last("chassis").com[1]) < 0.03;
  for (const char *wheel : {"front_left", "front_right", "rear_left", "rear_right"})
    on &= apart(run.last(std::string("hub_") + wheel), run.last(std::string("tyre_") + wheel)) < 0.03;
  return on;
}

// What is dragged at a taut line whose end goes along y runs on a tractrix: it comes from (0, 0), the line of
// length L from (L - 0.06, 0). 0.06: play in the ring.
bool dragged(const SceneRun &run) {
  constexpr double kLength = 1.26;
  const double d = run.last("lead").com[1], angle = 2 * std::atan(std::exp(-d / kLength));
  const test::BodyRow bag = run.last("bag");
  return std::hypot(bag.com[0] - (1.2 - kLength * std::sin(angle)),
                    bag.com[1] - (d - kLength * std::cos(angle))) < 0.03;
}

// The heavy side is down on the pad; both weights where they were laid.
bool tipped(const SceneRun &run) {
  const test::BodyRow light = run.last("light"), heavy = run.last("heavy");
  return light.com[2] - heavy.com[2] > 0.08 && std::fabs(heavy.com[0] - 0.31) < 0.03 &&
         std::fabs(light.com[0] + 0.33) < 0.03 && run.contact_counts("pad", 0).size() > 1 &&
         std::fabs(run.last("pad").com[0] - 0.45) < 0.02;
}

}  // namespace

// soak(bullet_double): bullet_float and ode make the same way through the library
TEST_P(EngineScenes, Box_RestsOnItsBedAsWithTheBuiltinHost) {
  expect_as_builtin(GetParam(), "ode_bed", {}, {"bed", "box"}, 0.16);
}
TEST(OdeBed, JitteredRuns_AllLand) {
  if (!test::kHasOde) GTEST_SKIP() << kNotBuilt;
  test::expect_jittered("ode_bed", 1, 10, lasting(1.3), 30, landed);
  EXPECT_FALSE(landed(SceneRun("ode_bed", lasting(1.3, {"/rigid/bodies/0/velocity=[2,0,0]"}))));
}

// soak(bullet_double): as above
TEST_P(EngineScenes, GrippedBall_IsWhereTheBuiltinHostHasIt) {
  expect_as_builtin(GetParam(), "ode_gripper", lifting(), {"ball", "left", "right"}, 0.1);
}
// What ODE's joints and motors hold is as still as what the builtin host's hold: motion of the ball against a
// finger over the last of four seconds.
// soak(bullet_double): as above
TEST_P(EngineScenes, LiftedBall_DoesNotSlip) {
  for (const char *step : {"0.001", "0.00416666666666667"}) {
    const SceneRun run("ode_gripper", lasting(4, {"/rigid/bodies/0/joints/0/motor/velocity=0.05",
                                                  std::string("/time/step=") + step, host()}));
    run.expect_valid(20, step);
    const auto ball = run.rows("ball"), finger = run.rows("left");
    const size_t end = ball.size() - 1, start = end - 2;  // every half second
    ASSERT_NEAR(ball[end].t - ball[start].t, 1, 1e-6);
    const double slip = ball[end].com[2] - finger[end].com[2] - ball[start].com[2] + finger[start].com[2];
    std::printf("  step %s s: %.3g micrometers per second\n", step, 1e6 * slip);
    EXPECT_LT(std::fabs(slip), 1e-7) << step;
    EXPECT_GT(ball[end].com[2], 0.25);
  }
}
TEST(OdeGripper, JitteredRuns_AllLift) {
  if (!test::kHasOde) GTEST_SKIP() << kNotBuilt;
  test::expect_jittered("ode_gripper", 1, 10, lifting(), 20, lifted);
  EXPECT_FALSE(lifted(SceneRun("ode_gripper", lifting({test::kFrictionless}))));
  EXPECT_FALSE(lifted(SceneRun("ode_gripper", lifting({"/rigid/bodies/1/joints/0/motor/max=12",
                                                       "/rigid/bodies/2/joints/0/motor/max=12"}))));
}

// soak(bullet_double): as above
TEST_P(EngineScenes, BrakedCart_RestsOnItsTiresAsWithTheBuiltinHost) {
  const std::vector<std::string> brakes = {"/rigid/bodies/3/joints/0/motor/velocity=0",
                                           "/rigid/bodies/4/joints/0/motor/velocity=0"};
  expect_as_builtin(GetParam(), "ode_cart", lasting(1, brakes),
                    {"chassis", "tyre_front_left", "tyre_rear_right", "hub_rear_left"}, 0.15);
}
TEST(OdeCart, Driven_ComesAsFarAsWithTheBuiltinHost) {
  if (!test::kHasOde) GTEST_SKIP() << kNotBuilt;
  expect_as_builtin("ode", "ode_cart", lasting(1), {"chassis", "tyre_front_left"}, 0.5);
}
// soak: long, and a jittered run of what another test runs
TEST(OdeCart, JitteredRuns_AllDriveUpTheBump) {
  if (!test::kHasOde) GTEST_SKIP() << kNotBuilt;
  test::expect_jittered("ode_cart", 1, 10, lasting(0.5), 60, drives);
}
TEST(OdeCart, WithoutGripOrBump_DoesNotDriveUpIt) {
  if (!test::kHasOde) GTEST_SKIP() << kNotBuilt;
  EXPECT_FALSE(drives(SceneRun(
      "ode_cart", lasting(0.5, {R"(/contact/friction=[{"between": ["*", "floor"], "law": "coulomb", )"
                                R"("params": {"mu": 0.05}}])"}))));
  EXPECT_FALSE(drives(SceneRun(
      "ode_cart", lasting(0.5, {R"(/contact/filter=[{"between": ["*", "bump"], "collide": false}])"}))));
}

// soak(bullet_double): as above
TEST_P(EngineScenes, Ring_IsDraggedWhereTheBuiltinHostDragsIt) {
  expect_as_builtin(GetParam(), "ode_chain", {}, {"bag", "link2", "peg"}, 0.15);
}
TEST(OdeChain, JitteredRuns_AllFollowTheTractrix) {
  if (!test::kHasOde) GTEST_SKIP() << kNotBuilt;
  test::expect_jittered("ode_chain", 1, 10, lasting(2), 30, dragged);
  EXPECT_FALSE(dragged(SceneRun("ode_chain", lasting(2, {test::kFrictionless}))));
}
// Joints enter the contact solve with what they did in the sub-step before; the error of that is of first
// order. Against 1/16 of the step.
TEST(OdeChain, Joints_ConvergeWithTheStep) {
  if (!test::kHasOde) GTEST_SKIP() << kNotBuilt;
  const auto at = [](const char *step) {
    return SceneRun("ode_chain", lasting(0.5, {std::string("/time/step=") + step}));
  };
  const SceneRun a = at("0.0005"), b = at("0.00025"), c = at("0.000125"), exact = at("0.00003125");
  for (const char *body : {"bag", "link2"}) {
    const double ea = apart(a.last(body), exact.last(body));
    const double eb = apart(b.last(body), exact.last(body));
    const double ec = apart(c.last(body), exact.last(body));
    std::printf("  %s: %.3g %.3g %.3g m\n", body, ea, eb, ec);
    EXPECT_LT(ea, 1e-4) << body;
    EXPECT_GT(std::log2(ea / eb), 0.7) << body;
    EXPECT_GT(std::log2(eb / ec), 0.7) << body;
  }
}

// soak(bullet_double): as above
TEST_P(EngineScenes, WeightsOfTheSeesaw_RestAsWithTheBuiltinHost) {
  expect_as_builtin(GetParam(), "ode_seesaw", {}, {"light", "heavy", "pad", "plank"}, 0.1);
}
TEST(OdeSeesaw, JitteredRuns_AllTip) {
  if (!test::kHasOde) GTEST_SKIP() << kNotBuilt;
  test::expect_jittered("ode_seesaw", 1, 10, lasting(0.8), 40, tipped);
  EXPECT_FALSE(tipped(SceneRun("ode_seesaw", lasting(0.8, {test::kFrictionless}))));
  EXPECT_FALSE(tipped(SceneRun("ode_seesaw", lasting(0.8, {"/materials/light/density=1200"}))));
}

INSTANTIATE_TEST_SUITE_P(Hosts, EngineScenes, ::testing::Values("ode", "bullet_float", "bullet_double"),
                         [](const auto &p) { return std::string(p.param); });
