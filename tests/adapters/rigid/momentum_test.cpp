// Soft bodies and bodies of an engine's world feel the same impulses, in the same sub-step, whatever numbers
// the engine computes with.
#include <gtest/gtest.h>

#include "engine.h"

namespace {

using namespace test;

template <class Body>
Momenta total(const Engine &engine, dfm_body soft, Body rigid) {
  Momenta m;
  add(m, measure(soft));
  engine.add_to(m, rigid);
  return m;
}

}  // namespace

TEST(Momentum, CollisionWithATumblingBox_KeepsBothMomenta) {
  Engine engine({0, 0, 0});
  set_friction(engine.soft, 0.6);
  const dfm_body ball = soft_ball(engine, {0, 0, 0.3}, {0.5, 0, -2});
  const auto plate = engine.box({0.15, 0.1, 0.03}, 2, {0.05, 0.02, 0.13}, {0, 0, 0.3});
  set_spin(plate, {1, 2, 4});
  const Momenta start = total(engine, ball, plate);
  const double before = measure(ball).momentum[2];
  engine.run(0.2);
  const Momenta end = total(engine, ball, plate);
  EXPECT_GT(stats(engine.soft).contacts_max, 5u);
  EXPECT_GT(std::fabs(measure(ball).momentum[2] - before), 1);
  EXPECT_LT(apart(start.linear, end.linear), 1e-12 * start.size);
  EXPECT_LT(apart(start.angular, end.angular), 1e-12 * start.size);
  EXPECT_EQ(engine.stats().corrections, 0u);
}

// The engine and the contact solve account for one impulse, not a force that comes a step later: the
// momentum that the soft ball loses within one step has arrived in the rigid one at the end of that step.
TEST(Momentum, EachStepOfAnImpact_ReportsTheSameImpulseOnBothSides) {
  Engine engine({0, 0, 0});
  const dfm_body ball = soft_ball(engine, {0, 0, 0.3}, {0, 0, -3});
  const auto target = engine.ball(0.1, 1, {0.02, 0, 0.09});
  double most = 0, exchanged = 0;
  for (int i = 0; i < 60; ++i) {
    const Momenta start = total(engine, ball, target);
    const Vec before = velocity(target);
    engine.step();
    most = std::max(most, apart(start.linear, total(engine, ball, target).linear) / start.size);
    exchanged = std::max(exchanged, apart(before, velocity(target)));
  }
  EXPECT_GT(exchanged, 0.05);
  EXPECT_LT(most, 1e-14);
}

TEST(Momentum, BodyOfThreeShapes_RespondsAsOne) {
  Engine engine({0, 0, 0});
  set_friction(engine.soft, 0.5);
  const dfm_body ball = soft_ball(engine, {0.1, 0, 0.3}, {0, 0.2, -2});
  const auto bar = engine.bar(1.5, {0.01, 0.03, 0.03}, {0, 0, 0.15});
  const Momenta start = total(engine, ball, bar);
  engine.run(0.15);
  const Momenta end = total(engine, ball, bar);
  EXPECT_EQ(engine.stats().bodies, 1u);
  EXPECT_EQ(engine.stats().shapes, 3u);
  EXPECT_GT(norm(spin(bar)), 1);  // struck off its center
  EXPECT_LT(apart(start.linear, end.linear), 1e-12 * start.size);
  EXPECT_LT(apart(start.angular, end.angular), 1e-12 * start.size);
}

TEST(Momentum, BoxOnASoftBed_IsCarriedByItsWeight) {
  Engine engine;
  soft_bed(engine);
  const auto box = engine.box({0.08, 0.08, 0.05}, 2, {0.15, 0.15, 0.152});
  engine.run(1.5);
  const dfm_rigid rigid = engine.rigid(box);
  double force[3], moment[3], mean = 0;
  for (int i = 0; i < 200; ++i) {
    engine.step();
    ok(dfm_rigid_contact_wrench(rigid, force, moment));
    mean += force[2] / 200;
  }
  EXPECT_NEAR(mean, 2 * 9.81, 2e-3 * 2 * 9.81);
  EXPECT_LT(norm(velocity(box)), 1e-3);
  EXPECT_GT(position(box)[2], 0.13);
}
