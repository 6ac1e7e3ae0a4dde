// The planner's rules on numbers alone: what it takes where every cost and error is given.
#include "scene/planner/accuracy.h"

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
  b.stiffens = 0.2;  // its swing errs by 2 % for it
  b.cell_size = 0.01;
  b.young = 1e5;
  b.poisson = 0.3;
  b.density = 1000;
  b.load = 9.81;
  b.held = true;
  b.models = {"springs", "elements", "cartoon"};
  return b;
}

// Its mesh alone errs by 0.3 %, not 1.8 %.
BodyRegime fine_bar() {
  BodyRegime b = bar();
  b.edge = 0.008;
  return b;
}

// A silicone finger that swings under its weight while a rod comes to its tip once: 725 points, and slivers
// that allow no more than 2 us of explicit time at once.
BodyRegime finger() {
  BodyRegime b = fine_bar();
  b.points = 725;
  b.length = 0.1;
  b.thickness = 0.02;
  b.edge = 0.002;
  b.cell_size = 0.0004;
  b.young = 2e5;
  b.poisson = 0.4;
  b.damping_stiffness = 3e-3;
  b.touches = true;
  b.approach = 0.09;
  b.depth = 0.026;
  b.presses = 1;
  b.models = {"elements"};
  return b;
}

Measured with_tr_bdf2() {
  Measured m = {"test", {model("elements", 0, 300, 5000)}};
  m.models[0].costs[2] = m.models[0].costs[1];
  return m;
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
  const PlannedWay fine = plan_accuracy({fine_bar()}, measured(), accuracy(0.01));
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

// Where no step is named, a shorter one costs more, since it is a frame that counts.
TEST(Planner, Budget_CountsForAFrame) {
  BodyRegime b = bar();
  b.models = {"elements"};
  b.scheme = static_cast<int>(Scheme::implicit_euler);
  const PlannedWay much = plan_accuracy({b}, measured(), budget(1000));
  ASSERT_TRUE(much.meets);
  EXPECT_LT(much.way.step, 1e-4) << "the shortest that is tried";
  EXPECT_NEAR(ms_per_step(much.way), 1e3 * much.way.cpu_s_per_s / 60, 1e-9);
  const PlannedWay some = plan_accuracy({b}, measured(), budget(0.26 * ms_per_step(much.way)));
  ASSERT_TRUE(some.meets);
  EXPECT_NEAR(some.way.step, 4 * much.way.step, 1e-12);
  Wish wish = budget(1000);
  wish.step = 1e-3;
  const PlannedWay named = plan_accuracy({b}, measured(), wish);
  EXPECT_NEAR(ms_per_step(named.way), named.way.cpu_s_per_s, 1e-9) << "a named step is a frame";
}

// Costs of implicit steps at 1/60 s and at a sixteenth of it: between them along a power law.
TEST(Planner, ShortSteps_CostWhatIsMeasuredForThem) {
  BodyRegime b = bar();
  b.models = {"elements"};
  b.scheme = static_cast<int>(Scheme::implicit_euler);
  Measured costs = measured();
  for (auto &sizes : costs.models[1].costs[1])
    for (dfm::CostAt &size : sizes) size.short_ns = size.ns / 4;
  const auto ns = [&](double step) {
    Wish wish = budget(1000);
    wish.step = step;
    return 1e9 * step * plan_accuracy({b}, costs, wish).way.cpu_s_per_s / b.points;
  };
  EXPECT_NEAR(ns(dfm::kCostStep), 5000, 1e-6);
  EXPECT_NEAR(ns(dfm::kCostStep / 4), 2500, 1e-6);
  EXPECT_NEAR(ns(dfm::kShortCostStep), 1250, 1e-6);
  EXPECT_NEAR(ns(dfm::kShortCostStep / 8), 1250, 1e-6) << "no less below";
  EXPECT_NEAR(ns(2 * dfm::kCostStep), 5000, 1e-6) << "no more above";
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

// The bounds of doc/concepts/step.md for the stiffest mode: h^2 w^2 + 2 h beta w^2 = 4 where dampers see the
// velocity; where they see a lag of it, a third of beta or 2 % at the slowest strain,
// h^2 w^2 (1 + beta/lag) = 4.
TEST(Planner, ExplicitStep_IsThatOfDampersWithALagWhereThatIsLonger) {
  BodyRegime b = bar();
  b.models = {"elements"};
  b.scheme = static_cast<int>(Scheme::explicit_euler);
  constexpr double kOffered = 0.9 * 0.9155;
  const auto step = [&](double beta) {
    b.damping_stiffness = beta;
    return plan_accuracy({b}, measured(), accuracy(0.1)).way.substep / kOffered;
  };
  const double free = step(0), w2 = 4 / (free * free);
  const double little = step(0.1 * free), slow = std::sqrt(12 * 1e5 / 1000) / 0.4, beta = 0.5;
  EXPECT_NEAR(little * little * w2 + 2 * little * 0.1 * free * w2, 4, 1e-9);
  EXPECT_NEAR(step(free), free / 2, 1e-9 * free);
  const double half = 0.5 * beta * slow, lag = 0.1 / (slow * (half + std::sqrt(half * half - 1)));
  EXPECT_NEAR(step(beta), free / std::sqrt(1 + beta / lag), 1e-9 * free);
}

// Model and time share the part of the target that the mesh leaves; if there is none, the choice says so.
TEST(Planner, CoarseMesh_MissesTheTargetInASentence) {
  BodyRegime b = bar();
  b.edge = 0.1;
  const PlannedWay plan = plan_accuracy({b}, measured(), accuracy(0.1));
  ASSERT_EQ(plan.assumed.size(), 2u);
  EXPECT_NE(plan.assumed[1].find("its mesh alone makes an error of about 26"), std::string::npos)
      << plan.assumed[1];
  EXPECT_FALSE(plan.meets);
  for (const char *word : {"the target of 10 % is not met", "body 'bar'", "mesh 26 %)",
                           " times as many cells, or few hexahedra"})
    EXPECT_NE(plan.missed.find(word), std::string::npos) << word << ": " << plan.missed;
  // what it says it takes leaves half of the target to model and time
  const char about[] = "about ";
  const double times = std::strtod(plan.missed.c_str() + plan.missed.find(about) + sizeof about - 1, nullptr);
  b.edge /= std::cbrt(times);
  const double there = plan_accuracy({b}, measured(), accuracy(0.1)).way.bodies[0].mesh_error;
  EXPECT_LT(there, 0.052) << times;
  EXPECT_GT(there, 0.045) << times;
  const PlannedWay fine = plan_accuracy({fine_bar()}, measured(), accuracy(0.1));
  EXPECT_TRUE(fine.meets);
  EXPECT_EQ(fine.missed, "");
  // springs err by 5 %, the mesh by 1.8 %
  EXPECT_EQ(plan_accuracy({bar()}, measured(), accuracy(0.06)).way.bodies[0].model, "elements");
}

// Where the mesh takes most of the target, a choice for the small rest is taken at up to four times the cost,
// and named where it costs more.
TEST(Planner, MeshThatLeavesLittle_IsNotPaidForWithManyTimesTheCost) {
  BodyRegime b = finger();
  b.edge = 0.0062;  // 4.3 %
  const PlannedWay plan = plan_accuracy({b}, with_tr_bdf2(), accuracy(0.06));
  ASSERT_TRUE(plan.meets) << plan.missed;
  EXPECT_LE(plan.way.error, 0.06);
  b.edge = 0.0069;  // 5.7 %
  const PlannedWay little = plan_accuracy({b}, with_tr_bdf2(), accuracy(0.06));
  EXPECT_FALSE(little.meets);
  EXPECT_LT(little.way.cpu_s_per_s, 2 * plan.way.cpu_s_per_s);
  EXPECT_NE(little.missed.find("s of processor per second, or a larger target"), std::string::npos)
      << little.missed;
}

TEST(Planner, WhatIsNamedAndMissesTheTarget_IsNamedInTheSentence) {
  BodyRegime b = fine_bar();
  b.model = "springs";
  const PlannedWay model = plan_accuracy({b}, measured(), accuracy(0.01));
  EXPECT_NE(model.missed.find("another model (leave model.type out"), std::string::npos) << model.missed;
  b = fine_bar();
  b.scheme = static_cast<int>(Scheme::implicit_euler);
  Wish wish = accuracy(0.01);
  wish.step = 1.0 / 60;
  const PlannedWay step = plan_accuracy({b}, measured(), wish);
  EXPECT_NE(step.missed.find("other steps (leave time.step and"), std::string::npos) << step.missed;
  // nothing is named, and the longest stable step is too long for what comes so fast
  b = fine_bar();
  b.touches = true;
  b.approach = 1000;
  b.models = {"springs"};
  const PlannedWay fast = plan_accuracy({b}, measured(), accuracy(0.2));
  EXPECT_NE(fast.missed.find("a time.step of at most"), std::string::npos) << fast.missed;
  EXPECT_EQ(fast.missed.find("cells"), std::string::npos) << fast.missed;
}

TEST(Planner, BudgetThatIsMissed_SaysWhatWouldMeetIt) {
  const double least = ms_per_step(plan_accuracy({bar()}, measured(), budget(1e-9)).way);
  const PlannedWay half = plan_accuracy({bar()}, measured(), budget(0.5 * least));
  for (const char *word : {"is not met", "at most about 0.59 times as many cells", "a larger budget"})
    EXPECT_NE(half.missed.find(word), std::string::npos) << word << ": " << half.missed;
  const PlannedWay none = plan_accuracy({bar()}, measured(), budget(1e-9));
  EXPECT_EQ(none.missed.find("cells"), std::string::npos) << none.missed;
}

// TR-BDF2 moves what touches by backward Euler, which takes the swing away. What a probe holds for longer
// than half a period does not swing: only that much counts, for each time that something comes, but not
// where the body's own weight carries it onto something.
TEST(Planner, StiffFingerUnderAProbe_MovesImplicitly) {
  const Measured costs = with_tr_bdf2();
  const PlannedWay plan = plan_accuracy({finger()}, costs, accuracy(0.06));
  ASSERT_TRUE(plan.meets) << plan.missed;
  EXPECT_EQ(plan.way.bodies[0].scheme, Scheme::tr_bdf2);
  BodyRegime b = finger();
  b.scheme = static_cast<int>(Scheme::explicit_euler);
  const PlannedWay slow = plan_accuracy({b}, costs, accuracy(0.06));
  EXPECT_LT(slow.way.substep, 3e-6);
  EXPECT_LT(30 * plan.way.cpu_s_per_s, slow.way.cpu_s_per_s);
  b = finger();
  b.below = 0.01;
  EXPECT_GT(plan_accuracy({b}, costs, accuracy(0.06)).way.cpu_s_per_s, 2 * plan.way.cpu_s_per_s);
}

// A small target takes steps below half a millisecond; explicit ones would be a hundred times shorter.
TEST(Planner, SmallTarget_TakesShortImplicitSteps) {
  BodyRegime b = finger();
  b.edge = 1e-4;
  const PlannedWay plan = plan_accuracy({b}, with_tr_bdf2(), accuracy(0.005));
  ASSERT_TRUE(plan.meets) << plan.missed;
  EXPECT_EQ(plan.way.bodies[0].scheme, Scheme::tr_bdf2);
  EXPECT_LT(plan.way.substep, 0.3e-3);
}

// Euler and Bernoulli: w = 1.875^2 sqrt(E I / (rho A L^4)).
TEST(Planner, LowestMode_IsTheBeams) {
  BodyRegime b = bar();
  const double inertia = std::pow(b.thickness, 4) / 12, area = b.thickness * b.thickness;
  const double w = 1.875 * 1.875 * std::sqrt(b.young * inertia / (b.density * area * std::pow(b.length, 4)));
  EXPECT_NEAR(dfm::estimate(b, 1).frequency, w, 1e-9 * w);
}

// Cells that are too stiff let a bar sag less and swing faster: without damping it ends up anywhere.
TEST(Planner, StiffMesh_SwingsFaster) {
  BodyRegime b = bar();
  b.stiffens = dfm::bending_of_tetrahedra(0.3);
  const auto error = [&](double duration, double damping) {
    Wish wish = accuracy(0.5);
    wish.duration = duration;
    b.damping_mass = damping;
    return plan_accuracy({b}, measured(), wish).way.bodies[0].mesh_error;
  };
  const double s = dfm::stiffening(b);
  EXPECT_NEAR(s, 1.4 * 0.04, 0.01 * s + 1e-3);
  EXPECT_NEAR(error(100, 20), s / (1 + s), 0.1 * s) << "it rests but for the start";
  EXPECT_LT(error(0.05, 0), 0.01 * s) << "it falls freely, as fast as any mesh";
  EXPECT_GT(error(20, 0), 0.8);
  EXPECT_LT(error(1e-9, 0), 0.01 * s) << "it has not moved yet";
  // a bar of hexahedra, one across
  b.edge = b.thickness;
  b.stiffens = dfm::kBendingOfHexahedra;
  EXPECT_LT(error(100, 20), 0.03);
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
  Wish wish = accuracy(0.11);
  const PlannedWay places = plan_accuracy({b}, costs, wish);
  EXPECT_EQ(places.way.bodies[0].model, "springs");
  EXPECT_DOUBLE_EQ(places.way.bodies[0].model_error, 0.09);
  ASSERT_EQ(places.assumed.size(), 2u);
  for (const char *word : {"'probe' touches it over about 0.02 m", "springs 300 % (places 9 %)",
                           "only the error of places counts"})
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

// A lattice has costs and a longest step of its own; of two plans the one that meets the target is taken,
// then the cheaper one.
TEST(Planner, Hexahedra_CostWhatIsMeasuredForThem) {
  BodyRegime b = bar();
  b.models = {"elements"};
  b.scheme = static_cast<int>(Scheme::explicit_euler);
  b.hexahedra = true;
  Measured costs = measured();
  const PlannedWay as_tetrahedra = plan_accuracy({b}, costs, accuracy(0.1));
  dfm::MeasuredCells &lattice = costs.models[1].hexahedra;
  lattice.costs[0].fill({{100, 100}, {1000, 100}});
  lattice.wave_steps = 2 * costs.models[1].wave_steps;
  const PlannedWay own = plan_accuracy({b}, costs, accuracy(0.1));
  EXPECT_NEAR(own.way.substep, 2 * as_tetrahedra.way.substep, 1e-12);
  EXPECT_NEAR(own.way.cpu_s_per_s, as_tetrahedra.way.cpu_s_per_s / 6, 1e-9);
  EXPECT_TRUE(wins(own, as_tetrahedra, accuracy(0.1)));
  EXPECT_FALSE(wins(as_tetrahedra, own, accuracy(0.1)));
  b.edge = b.thickness;
  const PlannedWay coarse = plan_accuracy({b}, costs, accuracy(0.1));
  ASSERT_FALSE(coarse.meets);
  EXPECT_TRUE(wins(own, coarse, accuracy(0.1)));
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
