// Bodies that ODE's joints, motors and rigid contacts hold, in the solve with what these did last and
// one correction.
#include <gtest/gtest.h>

#include "ode.h"

namespace {

using namespace test;

dJointID ball_joint(Ode &ode, dBodyID a, dBodyID b, Vec at) {
  const dJointID j = dJointCreateBall(ode.world, nullptr);
  dJointAttach(j, a, b);
  dJointSetBallAnchor(j, at[0], at[1], at[2]);
  return j;
}

// A chain of n balls on ball joints from x = 0 along x.
std::vector<dBodyID> chain(Ode &ode, int n, double length, double mass, double z, bool fixed) {
  std::vector<dBodyID> links;
  for (int i = 0; i < n; ++i) {
    const double x = length * (i + 0.5);
    links.push_back(ode.body(mass, {1e-4, 1e-3, 1e-3}, {x, 0, z}));
    dGeomSetBody(dCreateSphere(ode.space, 0.3 * length), links.back());
    if (i > 0) ball_joint(ode, links[size_t(i) - 1], links.back(), {length * i, 0, z});
  }
  if (fixed) ball_joint(ode, links.front(), nullptr, {0, 0, z});
  return links;
}

}  // namespace

// Joints are ODE's: it keeps linear momentum, and angular momentum as well as its anchors coincide.
TEST(OdeJoints, FreeChainStruckByASoftBall_KeepsMomentumInEachStep) {
  Ode ode({0, 0, 0});
  set_friction(ode.soft, 0.5);
  const std::vector<dBodyID> links = chain(ode, 4, 0.1, 0.5, 0, false);
  const dfm_body ball = soft_ball(ode, {0.3, 0.01, 0.15}, {0.3, 0, -2});
  double linear = 0, angular = 0;
  for (int i = 0; i < 200; ++i) {
    Momenta start, end;
    add(start, ball);
    for (const dBodyID b : links) add(start, b);
    ode.step();
    add(end, ball);
    for (const dBodyID b : links) add(end, b);
    linear = std::max(linear, apart(start.linear, end.linear) / start.size);
    angular = std::max(angular, apart(start.angular, end.angular) / start.size);
  }
  EXPECT_GT(norm(velocity(links.back())), 0.1);
  EXPECT_LT(linear, 1e-9);
  EXPECT_LT(angular, 1e-9);
}

// A hanging chain with a soft ball on it: error of the scheme against the finest step.
TEST(OdeJoints, Chain_ConvergesWithTheStep) {
  const auto end = [](double h) {
    Ode ode;
    dWorldSetERP(ode.world, 0.8);
    const std::vector<dBodyID> links = chain(ode, 4, 0.1, 0.5, 0, true);
    soft_ball(ode, {0.35, 0, 0.14}, {0, 0, -1}, 2e4, 5);
    ode.run(0.16, h);
    return position(links.back());
  };
  const Vec exact = end(3.125e-5);
  const double a = apart(end(1e-3), exact), b = apart(end(5e-4), exact), c = apart(end(2.5e-4), exact);
  EXPECT_LT(a, 1.5e-3);
  EXPECT_NEAR(std::log2(a / b), 1, 0.2);
  EXPECT_NEAR(std::log2(b / c), 1, 0.2);
}

// A ball that soft bodies ignore falls beside a struck chain: ODE moves it once per sub-step, however often
// contact is solved again.
TEST(OdeJoints, IgnoredBodyBesideCorrections_FallsAsOdeLetsIt) {
  Ode ode;
  const std::vector<dBodyID> links = chain(ode, 4, 0.1, 0.5, 0, true);
  soft_ball(ode, {0.35, 0, 0.14}, {0, 0, -1}, 2e4, 5);
  const dBodyID stone = ode.body(1, {1e-3, 1e-3, 1e-3}, {2, 0, 1});
  const dGeomID geom = dCreateSphere(ode.space, 0.1);
  dGeomSetBody(geom, stone);
  dfm_ode_geom props{};
  props.size = sizeof props;
  props.ignore = 1;
  ok(dfm_ode_set_geom(ode.adapter, geom, &props));
  constexpr double h = 1e-3;
  const int n = 200;
  for (int i = 0; i < n; ++i) ode.step(h);
  EXPECT_GT(ode.stats().corrections, 0u);
  EXPECT_NEAR(velocity(stone)[2], -9.81 * n * h, 1e-9);
}

// Two fingers on sliders close on a soft ball with motors, a third motor lifts the palm. Twice the force that
// friction needs.
struct Gripper {
  Ode ode;
  dBodyID palm, finger[2];
  dJointID lift, close[2];
  dfm_body ball;
  explicit Gripper(uint32_t flags = 0) : ode({0, 0, -9.81}, flags) {
    constexpr double kMu = 0.5;
    set_friction(ode.soft, kMu);
    BodyOptions o;
    o.name = "ball";
    o.young = 6e3;
    o.poisson = 0.3;
    o.density = 200;
    o.damping_stiffness = 0.01;
    o.damping_mass = 5;
    ball = make_body(ode.context, ode.soft, "ball", {0.05}, 500, o);
    palm = ode.box({0.2, 0.03, 0.02}, 1, {0, 0, 0.15});
    lift = dJointCreateSlider(ode.world, nullptr);
    dJointAttach(lift, palm, nullptr);
    dJointSetSliderAxis(lift, 0, 0, 1);
    dJointSetSliderParam(lift, dParamFMax, 400);
    for (int k = 0; k < 2; ++k) {
      const double side = k ? 1 : -1;
      finger[k] = ode.box({0.01, 0.04, 0.05}, 0.3, {0.062 * side, 0, 0});
      close[k] = dJointCreateSlider(ode.world, nullptr);
      dJointAttach(close[k], finger[k], palm);
      dJointSetSliderAxis(close[k], 1, 0, 0);
      dJointSetSliderParam(close[k], dParamVel, -0.5 * side);
      dJointSetSliderParam(close[k], dParamFMax, 2 * measure(ball).mass * 9.81 / (2 * kMu));
    }
    dGeomDisable(dBodyGetFirstGeom(palm));
  }
  // Height of the ball above the palm's.
  double held() const { return measure(ball).com[2] - position(palm)[2]; }
};

class OdeGripper : public ::testing::TestWithParam<double> {};

// unsanitized: too slow there; shorter tests run the same code
TEST_P(OdeGripper, LiftsABallAndHoldsIt) {
  Gripper g;
  const double h = GetParam();
  g.ode.run(0.05, h);  // grip; the ball has fallen by a centimeter at most
  dJointSetSliderParam(g.lift, dParamVel, 0.2);
  g.ode.run(0.5, h);
  dJointSetSliderParam(g.lift, dParamVel, 0);
  g.ode.run(2, h);
  EXPECT_NEAR(position(g.palm)[2], 0.15 + 0.1, 2e-3);
  EXPECT_GT(measure(g.ball).com[2], 0.05);
  const double before = g.held();
  g.ode.run(1, h);
  EXPECT_LT(std::fabs(g.held() - before), 1e-7);
  EXPECT_LT(g.ode.stats().residual_max, 0.02);
}
INSTANTIATE_TEST_SUITE_P(Steps, OdeGripper, ::testing::Values(1e-3, 1.0 / 240));

// What a hinge reports is what it carries: the plate and the soft ball on it.
TEST(OdeJoints, Feedback_HasTheLoadOfTheSoftBody) {
  Ode ode;
  set_friction(ode.soft, 0.8);
  const dBodyID plate = ode.box({0.2, 0.2, 0.02}, 1.5, {0, 0, 0});
  const dJointID hold = dJointCreateFixed(ode.world, nullptr);
  dJointAttach(hold, plate, nullptr);
  dJointSetFixed(hold);
  dJointFeedback feedback{};
  dJointSetFeedback(hold, &feedback);
  const dfm_body ball = soft_ball(ode, {0.05, 0, 0.122}, {}, 3e4, 30);
  ode.run(0.8);
  double mean = 0, moment = 0;
  for (int i = 0; i < 100; ++i) {
    ode.step();
    mean += feedback.f1[2] / 100;
    moment += feedback.t1[1] / 100;
  }
  const double weight = measure(ball).mass * 9.81;
  EXPECT_NEAR(mean, 1.5 * 9.81 + weight, 0.01 * weight);
  EXPECT_NEAR(moment, -weight * measure(ball).com[0], 0.02 * weight * 0.05);
  EXPECT_EQ(dJointGetFeedback(hold), &feedback);
}

// A body's own frame may stand askew to its principal axes.
TEST(OdeJoints, SkewInertia_IsTheMatrixThatOdeHas) {
  Ode ode({0, 0, 0});
  const dfm_body ball = soft_ball(ode, {0.08, 0.03, 0.25}, {0, 0, -2});
  const dBodyID b = dBodyCreate(ode.world);
  dMass m;
  dMassSetParameters(&m, 1, 0, 0, 0, 0.010, 0.012, 0.014, 0.002, -0.001, 0.003);
  dBodySetMass(b, &m);
  dBodySetPosition(b, 0, 0, 0.09);
  dBodySetAngularVel(b, 0.3, -0.5, 0.2);
  dGeomSetBody(dCreateBox(ode.space, 0.2, 0.2, 0.1), b);
  Momenta start, end;
  add(start, ball);
  add(start, b);
  ode.run(0.15);
  add(end, ball);
  add(end, b);
  EXPECT_GT(apart(velocity(b), {}), 0.1);
  EXPECT_LT(apart(start.linear, end.linear), 1e-12 * start.size);
  EXPECT_LT(apart(start.angular, end.angular), 1e-12 * start.size);
}
