// Bodies that ODE's joints, motors and rigid contacts hold, in the solve with what these did last and one correction.
#include <gtest/gtest.h>

#include "ode.h"

namespace {

using namespace test;

dJointID ball_joint(Ode &ode, dBodyID a, dBodyID b, Vec at) {
  const dJointID j = dJointCreateBall(ode.world, nullptr);
  dJointAttach(j, a, b), dJointSetBallAnchor(j, at[0], at[1], at[2]);
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
  RecordProperty("linear", std::to_string(linear)), RecordProperty("angular", std::to_string(angular));
  std::printf("linear %g angular %g residual %g corrections %lu of %lu\n", linear, angular, ode.stats().residual_max, (unsigned long)ode.stats().corrections, (unsigned long)ode.stats().ode_steps);
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
    std::printf("h %g: z %.9g corrections %lu steps %lu residual %g\n", h, position(links.back())[2], (unsigned long)ode.stats().corrections, (unsigned long)ode.stats().ode_steps, ode.stats().residual_max);
    return position(links.back());
  };
  const Vec exact = end(3.125e-5);
  const double a = apart(end(1e-3), exact), b = apart(end(5e-4), exact), c = apart(end(2.5e-4), exact);
  std::printf("errors %g %g %g: orders %g %g\n", a, b, c, std::log2(a / b), std::log2(b / c));
}
