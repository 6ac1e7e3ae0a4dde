// Soft bodies and bodies of an ODE world feel the same impulses, in the same sub-step.
#include <gtest/gtest.h>

#include "ode.h"

namespace {

using namespace test;

Momenta total(dfm_body soft, std::initializer_list<dBodyID> rigid) {
  Momenta m;
  add(m, soft);
  for (const dBodyID b : rigid) add(m, b);
  return m;
}

}  // namespace

TEST(OdeMomentum, CollisionWithATumblingBox_KeepsBothMomenta) {
  Ode ode({0, 0, 0});
  set_friction(ode.soft, 0.6);
  const dfm_body ball = soft_ball(ode, {0, 0, 0.3}, {0.5, 0, -2});
  const dBodyID plate = ode.box({0.15, 0.1, 0.03}, 2, {0.05, 0.02, 0.13}, {0, 0, 0.3});
  dBodySetAngularVel(plate, 1, 2, 4);
  const Momenta start = total(ball, {plate});
  const double before = measure(ball).momentum[2];
  ode.run(0.2);
  const Momenta end = total(ball, {plate});
  EXPECT_GT(stats(ode.soft).contacts_max, 5u);
  EXPECT_GT(std::fabs(measure(ball).momentum[2] - before), 1);
  EXPECT_LT(apart(start.linear, end.linear), 1e-12 * start.size);
  EXPECT_LT(apart(start.angular, end.angular), 1e-12 * start.size);
  EXPECT_EQ(ode.stats().corrections, 0u);
}

// What ODE and the contact solve book is one impulse, not a force that comes a step later: the momentum that
// the soft ball loses within one step has arrived in the rigid one at the end of that step.
TEST(OdeMomentum, EachStepOfAnImpact_BooksTheSameImpulseOnBothSides) {
  Ode ode({0, 0, 0});
  const dfm_body ball = soft_ball(ode, {0, 0, 0.3}, {0, 0, -3});
  const dBodyID target = ode.ball(0.1, 1, {0.02, 0, 0.09});
  double most = 0, exchanged = 0;
  for (int i = 0; i < 60; ++i) {
    const Momenta start = total(ball, {target});
    const Vec before = velocity(target);
    ode.step();
    most = std::max(most, apart(start.linear, total(ball, {target}).linear) / start.size);
    exchanged = std::max(exchanged, apart(before, velocity(target)));
  }
  EXPECT_GT(exchanged, 0.05);
  EXPECT_LT(most, 1e-14);
}

TEST(OdeMomentum, BodyOfThreeGeoms_AnswersAsOne) {
  Ode ode({0, 0, 0});
  set_friction(ode.soft, 0.5);
  const dfm_body ball = soft_ball(ode, {0.1, 0, 0.3}, {0, 0.2, -2});
  const dBodyID bar = ode.body(1.5, {0.01, 0.03, 0.03}, {0, 0, 0.15});
  for (const double x : {-0.15, 0.0, 0.15}) {
    const dGeomID g = dCreateSphere(ode.space, 0.05);
    dGeomSetBody(g, bar);
    dGeomSetOffsetPosition(g, x, 0, 0);
  }
  const Momenta start = total(ball, {bar});
  ode.run(0.15);
  const Momenta end = total(ball, {bar});
  EXPECT_EQ(ode.stats().bodies, 1u);
  EXPECT_EQ(ode.stats().shapes, 3u);
  EXPECT_GT(norm(vec(dBodyGetAngularVel(bar))), 1);  // struck off its center
  EXPECT_LT(apart(start.linear, end.linear), 1e-12 * start.size);
  EXPECT_LT(apart(start.angular, end.angular), 1e-12 * start.size);
}

// A body's own frame may stand askew to its principal axes.
TEST(OdeMomentum, SkewInertia_IsTheMatrixThatOdeHas) {
  Ode ode({0, 0, 0});
  const dfm_body ball = soft_ball(ode, {0.08, 0.03, 0.25}, {0, 0, -2});
  const dBodyID b = dBodyCreate(ode.world);
  dMass m;
  dMassSetParameters(&m, 1, 0, 0, 0, 0.010, 0.012, 0.014, 0.002, -0.001, 0.003);
  dBodySetMass(b, &m);
  dBodySetPosition(b, 0, 0, 0.09);
  dBodySetAngularVel(b, 0.3, -0.5, 0.2);
  dGeomSetBody(dCreateBox(ode.space, 0.2, 0.2, 0.1), b);
  const Momenta start = total(ball, {b});
  ode.run(0.15);
  const Momenta end = total(ball, {b});
  EXPECT_GT(apart(velocity(b), {}), 0.1);
  EXPECT_LT(apart(start.linear, end.linear), 1e-12 * start.size);
  EXPECT_LT(apart(start.angular, end.angular), 1e-12 * start.size);
}

TEST(OdeMomentum, BoxOnASoftBed_IsCarriedByItsWeight) {
  Ode ode;
  soft_bed(ode);
  const dBodyID box = ode.box({0.08, 0.08, 0.05}, 2, {0.15, 0.15, 0.152});
  ode.run(1.5);
  dfm_rigid rigid = 0;
  ok(dfm_ode_rigid(ode.adapter, box, &rigid));
  double force[3], moment[3], mean = 0;
  for (int i = 0; i < 200; ++i) {
    ode.step();
    ok(dfm_rigid_contact_wrench(rigid, force, moment));
    mean += force[2] / 200;
  }
  EXPECT_NEAR(mean, 2 * 9.81, 2e-3 * 2 * 9.81);
  EXPECT_LT(norm(velocity(box)), 1e-3);
  EXPECT_GT(position(box)[2], 0.13);
}
