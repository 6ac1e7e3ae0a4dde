// The planner's rules on numbers alone: what it takes where every cost and error is given.
#include "plan/accuracy.h"

#include <gtest/gtest.h>

#include <cmath>

namespace {

using dfm::BodyRegime;
using dfm::Measured;
using dfm::MeasuredModel;
using dfm::PlannedWay;
using dfm::Scheme;
using dfm::Wish;

MeasuredModel model(const char *id, double error, double explicit_ns, double implicit_ns) {
  MeasuredModel m;
  m.id = id;
  m.bends_little = m.bends_far = m.lies = error;
  m.wave_steps = 0.5;
  m.costs[0].fill({{100, explicit_ns}, {1000, explicit_ns}});
  if (implicit_ns > 0) m.costs[1].fill({{100, implicit_ns}, {1000, implicit_ns}});
  return m;
}

// A held bar of 500 points.
BodyRegime bar() {
  BodyRegime b;
  b.name = "bar";
  b.points = 500;
  b.length = 0.4;
  b.thickness = 0.1;
  b.edge = 0.02;
  b.cell_size = 0.01;
  b.young = 1e5;
  b.poisson = 0.3;
  b.density = 1000;
  b.load = 9.81;
  b.held = true;
  b.models = {"springs", "elements", "cartoon"};
  return b;
}

Measured measured() {
  return {"test",
          {model("springs", 0.05, 100, 0), model("elements", 0, 300, 5000), model("cartoon", 1, 10, 0)}};
}

Wish accuracy(double target) {
  Wish w;
  w.target = target;
  w.duration = 1;
  return w;
}

Wish budget(double ms) {
  Wish w;
  w.ms_per_step = ms;
  w.duration = 1;
  return w;
}

}  // namespace

TEST(Planner, Target_TakesTheCheapestThatMeetsIt) {
  const PlannedWay coarse = plan_accuracy({bar()}, measured(), accuracy(0.1));
  ASSERT_TRUE(coarse.found && coarse.meets);
  EXPECT_EQ(coarse.way.bodies[0].model, "springs");
  const PlannedWay fine = plan_accuracy({bar()}, measured(), accuracy(0.01));
  ASSERT_TRUE(fine.meets);
  EXPECT_EQ(fine.way.bodies[0].model, "elements");
  EXPECT_GT(fine.way.cpu_s_per_s, coarse.way.cpu_s_per_s);
}

TEST(Planner, Budget_TakesTheBestThatIsWithinIt) {
  const double springs = ms_per_step(plan_accuracy({bar()}, measured(), accuracy(0.1)).way);
  const double elements = ms_per_step(plan_accuracy({bar()}, measured(), accuracy(0.01)).way);
  EXPECT_EQ(plan_accuracy({bar()}, measured(), budget(1.01 * elements)).way.bodies[0].model, "elements");
  EXPECT_EQ(plan_accuracy({bar()}, measured(), budget(1.01 * springs)).way.bodies[0].model, "springs");
  const PlannedWay none = plan_accuracy({bar()}, measured(), budget(1e-9));
  EXPECT_FALSE(none.meets);
  EXPECT_EQ(none.way.bodies[0].model, "cartoon");  // the cheapest
}

TEST(Planner, WhatTheSceneNames_Stays) {
  BodyRegime b = bar();
  b.model = "cartoon";
  const PlannedWay plan = plan_accuracy({b}, measured(), accuracy(0.01));
  EXPECT_FALSE(plan.meets);
  EXPECT_EQ(plan.way.bodies[0].model, "cartoon");
  b = bar();
  b.scheme = static_cast<int>(Scheme::implicit_euler);
  EXPECT_EQ(plan_accuracy({b}, measured(), accuracy(0.1)).way.bodies[0].scheme, Scheme::implicit_euler);
  b.model = "nobody";
  EXPECT_FALSE(plan_accuracy({b}, measured(), accuracy(0.1)).found);
}

TEST(Planner, StiffBody_MovesImplicitly) {
  BodyRegime b = bar();
  b.young = 1e9;
  b.damping_mass = 1e6;  // no oscillation that backward Euler could take away
  b.models = {"elements"};
  const PlannedWay plan = plan_accuracy({b}, measured(), accuracy(0.2));
  EXPECT_EQ(plan.way.bodies[0].scheme, Scheme::implicit_euler);
}

// The bound of doc/concepts/step.md for the stiffest mode: h^2 w^2 + 2 h beta w^2 = 4. Of its solution the
// same part is offered with damping and without.
TEST(Planner, DampingShortensTheExplicitStep) {
  BodyRegime b = bar();
  b.models = {"elements"};
  b.scheme = static_cast<int>(Scheme::explicit_euler);
  constexpr double kOffered = 0.9 * 0.9155;
  const double free = plan_accuracy({b}, measured(), accuracy(0.1)).way.substep / kOffered;
  b.damping_stiffness = free;
  const double damped = plan_accuracy({b}, measured(), accuracy(0.1)).way.substep / kOffered;
  const double w2 = 4 / (free * free);
  EXPECT_NEAR(damped * damped * w2 + 2 * damped * free * w2, 4, 1e-9);
}

TEST(Planner, CoarseMesh_IsReported) {
  BodyRegime b = bar();
  b.edge = 0.1;
  const PlannedWay plan = plan_accuracy({b}, measured(), accuracy(0.1));
  ASSERT_EQ(plan.assumed.size(), 2u);
  EXPECT_NE(plan.assumed[1].find("its mesh alone makes an error of about 0.45"), std::string::npos);
}

// Euler and Bernoulli: w = 1.875^2 sqrt(E I / (rho A L^4)).
TEST(Planner, LowestMode_IsTheBeams) {
  BodyRegime b = bar();
  const double inertia = std::pow(b.thickness, 4) / 12, area = b.thickness * b.thickness;
  const double w = 1.875 * 1.875 * std::sqrt(b.young * inertia / (b.density * area * std::pow(b.length, 4)));
  EXPECT_NEAR(dfm::estimate(b, 1).frequency, w, 1e-9 * w);
}

// A probe that is narrower than the body dents it: then errors of a dent count, of places where those are
// asked for, of the force too where that is, and a force may be wrong by more than itself.
TEST(Planner, DentUnderAProbe_CountsWithItsOwnErrors) {
  BodyRegime b = bar();
  b.touches = true;
  b.contact = 0.02;
  b.met = "'probe'";
  b.models = {"springs", "elements"};
  Measured costs = measured();
  costs.models[0].dents = 0.09;
  costs.models[0].dent_force = 3;
  Wish wish = accuracy(0.1);
  const PlannedWay places = plan_accuracy({b}, costs, wish);
  EXPECT_EQ(places.way.bodies[0].model, "springs");
  EXPECT_DOUBLE_EQ(places.way.bodies[0].model_error, 0.09);
  ASSERT_EQ(places.assumed.size(), 2u);
  for (const char *word : {"'probe' touches it over about 0.02 m", "springs 3 (places 0.09)", "places alone"})
    EXPECT_NE(places.assumed[1].find(word), std::string::npos) << word << " in " << places.assumed[1];
  wish.force = true;
  EXPECT_EQ(plan_accuracy({b}, costs, wish).way.bodies[0].model, "elements");
  b.models = {"springs"};
  const PlannedWay alone = plan_accuracy({b}, costs, wish);
  EXPECT_FALSE(alone.meets);
  EXPECT_DOUBLE_EQ(alone.way.error, 3);
  b.contact = b.thickness;
  EXPECT_FALSE(dfm::dented(b));
  EXPECT_TRUE(plan_accuracy({b}, costs, wish).meets);
}

// What a sub-step costs goes by what is met.
TEST(Planner, WhatABodyMeets_DecidesItsCost) {
  Measured costs = measured();
  for (size_t k = 0; k < dfm::kMeets; ++k)
    costs.models[0].costs[0][k] = {{100, 100.0 * double(k + 1)}, {1000, 100.0 * double(k + 1)}};
  BodyRegime b = bar();
  b.models = {"springs"};
  const auto cost = [&] { return plan_accuracy({b}, costs, accuracy(0.1)).way.cpu_s_per_s; };
  const double free = cost();
  b.touches = true;
  EXPECT_EQ(dfm::what_it_meets(b), dfm::Meets::probe);
  EXPECT_DOUBLE_EQ(cost(), 3 * free);
  b.meets_body = true;
  EXPECT_DOUBLE_EQ(cost(), 4 * free);
  b.held = b.meets_body = false;
  EXPECT_EQ(dfm::what_it_meets(b), dfm::Meets::ground);
}

// Where a probe is, is known to a sub-step, and so is its force.
TEST(Planner, ProbeThatComes_IsKnownToASubStep) {
  BodyRegime b = bar();
  b.load = 0;
  b.touches = true;
  b.approach = 0.045;
  b.depth = 0.008;
  b.models = {"elements"};
  b.scheme = static_cast<int>(Scheme::implicit_euler);
  Measured costs = {"test", {model("elements", 0, 300, 5000)}};
  Wish wish = accuracy(0.5);
  wish.step = 1.0 / 60;
  EXPECT_NEAR(plan_accuracy({b}, costs, wish).way.bodies[0].time_error, 0.045 / 60 / 0.008, 1e-12);
}
