// The builtin rigid host on its own against closed forms: spins, pendulums, motors, joints.
#include <gtest/gtest.h>

#include <functional>

#include "rigid.h"

namespace {

using namespace test;

// Seconds between the first and the last rise of x through 0, per rise. Linear between steps.
double period(dfm_world w, double duration, double h, const std::function<double()> &x) {
  double before = x(), first = -1, last = 0;
  int rises = -1;
  for (double t = 0; t < duration; t += h) {
    run(w, h, h);
    const double now = x();
    if (before < 0 && now >= 0) {
      last = t + h * (-before / (now - before));
      if (rises++ < 0) first = last;
    }
    before = now;
  }
  EXPECT_GT(rises, 2);
  return (last - first) / rises;
}

}  // namespace

// Free fall: symplectic Euler puts a body at g t (t + h) / 2.
TEST(Rigid, FreeFall_IsThatOfSymplecticEuler) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  const dfm_rigid r = create(w, {box("box", {0.1, 0.2, 0.3}, 2)})[0];
  run(w, 1, 1e-3);
  EXPECT_NEAR(state(r).position[2], -9.81 / 2 * (1 + 1e-3), 1e-12);
  EXPECT_NEAR(state(r).velocity[2], -9.81, 1e-12);
}

// A ball that spins turns by w t exactly; after a whole number of turns it is back.
TEST(Rigid, SpinningBall_ReturnsAfterTenTurns) {
  test::Context c;
  const dfm_world w = test::make_world(c, {0, 0, 0});
  dfm_rigid_def d = dfm_rigid_def_default();
  const double pi = 3.14159265358979323846;
  d.spin[0] = 2 * pi * 6;
  d.spin[2] = 2 * pi * 8;  // 10 turns a second
  const dfm_rigid r = create(w, {d})[0];
  run(w, 1, 1e-3);
  EXPECT_NEAR(std::fabs(state(r).rotation[3]), 1, 1e-13);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(state(r).rotation[k], 0, 1e-11);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(state(r).spin[k], d.spin[k], 1e-10);
}

// Angular momentum of a tumbling box over 1e4 steps; its energy swings without drifting, and less with the
// square of the step.
TEST(Rigid, TumblingBox_KeepsAngularMomentum) {
  double swing[2];
  for (int fine = 0; fine < 2; ++fine) {
    test::Context c;
    const dfm_world w = test::make_world(c, {0, 0, 0});
    dfm_rigid_def d = box("box", {0.1, 0.25, 0.4}, 1.5);
    d.spin[0] = 0.01;
    d.spin[1] = 7;
    d.spin[2] = 0.02;  // about the middle axis: it turns over
    const dfm_rigid r = create(w, {d})[0];
    const dfm_body_measure start = rigid_measure(r);
    const double h = fine ? 5e-4 : 1e-3;
    swing[fine] = 0;
    double lowest = 1;
    for (int k = 0; k < 10000; ++k) {
      run(w, h, h);
      swing[fine] = std::max(swing[fine], std::fabs(rigid_measure(r).kinetic / start.kinetic - 1));
      lowest = std::min(lowest, dot(vec(state(r).spin), {0, 1, 0}) / 7);
    }
    const dfm_body_measure end = rigid_measure(r);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(end.angular[k], start.angular[k], 1e-10 * norm(vec(start.angular)));
    EXPECT_NEAR(end.kinetic, start.kinetic, 1e-4 * start.kinetic);
  }
  EXPECT_LT(swing[0], 1e-4);
  EXPECT_NEAR(swing[0] / swing[1], 4, 1.5);
}

// Compound pendulum: T = 2 pi sqrt(I_pivot / (m g l)) (1 + a^2 / 16) for small amplitudes a.
TEST(Rigid, HingedRod_SwingsWithItsPeriod) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  const dfm_rigid r = create(w, {box("rod", {0.02, 0.03, 0.5}, 2, {0.5, 0, 0})},
                             {joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0.5, 0, 0.5}, {0, 1, 0})})[0];
  dfm_rigid_state s = state(r);
  const double a = 0.1;  // tilted about the pivot
  s.rotation[1] = std::sin(a / 2);
  s.rotation[3] = std::cos(a / 2);
  s.position[0] = 0.5 - 0.5 * std::sin(a);
  s.position[2] = 0.5 - 0.5 * std::cos(a);
  test::ok(dfm_rigid_set_state(r, &s));
  const double inertia = 2.0 / 3 * (0.02 * 0.02 + 0.5 * 0.5) + 2 * 0.25;
  const double expected = 2 * 3.14159265358979 * std::sqrt(inertia / (2 * 9.81 * 0.5)) * (1 + a * a / 16);
  const double found = period(w, 6, 1e-3, [&] { return state(r).position[0] - 0.5; });
  EXPECT_NEAR(found, expected, 0.005 * expected);
  const Vec arm = {state(r).position[0] - 0.5, state(r).position[1], state(r).position[2] - 0.5};
  EXPECT_NEAR(norm(arm), 0.5, 1e-9);  // where the joint is held
  double angle = 0;
  test::ok(dfm_rigid_joint(r, 0, &angle, nullptr, nullptr));
  EXPECT_NEAR(angle, std::atan2(-arm[0], -arm[2]), 1e-9);
}

// A ball on a string that is stiff to bending: a ball joint, a heavy bob far from it, swinging about
// a slanted axis.
TEST(Rigid, BallJoint_SwingsWithItsPeriod) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  dfm_rigid_def d = dfm_rigid_def_default();
  d.radius = 0.05;
  d.mass = 3;
  d.velocity[0] = 0.06;
  d.velocity[1] = 0.08;
  d.spin[0] = 0.08;
  d.spin[1] = -0.06;  // l = 1: w x r = v
  const dfm_rigid r = create(w, {d}, {joint(DFM_JOINT_BALL, 0, DFM_RIGID_WORLD, {0, 0, 1})})[0];
  const double inertia = 0.4 * 3 * 0.05 * 0.05 + 3;
  const double expected = 2 * 3.14159265358979 * std::sqrt(inertia / (3 * 9.81));
  const double found = period(w, 9, 1e-3, [&] { return state(r).position[0]; });
  EXPECT_NEAR(found, expected, 0.005 * expected);
  EXPECT_NEAR(state(r).position[1] * 0.06, state(r).position[0] * 0.08, 1e-6);  // stays in its plane
}

// A slider falls along its axis only; off it nothing moves.
TEST(Rigid, SlantedSlider_FallsAlongItsAxis) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  const dfm_rigid r = create(w, {box("sled", {0.1, 0.1, 0.1}, 2)},
                             {joint(DFM_JOINT_SLIDER, 0, DFM_RIGID_WORLD, {0.3, 0, 0}, {3, 0, -4})})[0];
  run(w, 1, 1e-3);
  const double path = 0.8 * 9.81 / 2 * (1 + 1e-3);
  EXPECT_NEAR(state(r).position[0], 0.6 * path, 1e-9);
  EXPECT_NEAR(state(r).position[1], 0, 1e-12);
  EXPECT_NEAR(state(r).position[2], -0.8 * path, 1e-9);
  EXPECT_NEAR(std::fabs(state(r).rotation[3]), 1, 1e-12);
  double position = 0, rate = 0;
  test::ok(dfm_rigid_joint(r, 0, &position, &rate, nullptr));
  EXPECT_NEAR(position, path, 1e-9);
  EXPECT_NEAR(rate, 0.8 * 9.81, 1e-9);
}

// A motor that can do less than the weight lets the body sink with the difference; one that can do more holds
// its speed and says what it does.
TEST(Rigid, SliderMotor_DoesAtMostItsForce) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  dfm_joint_def j = joint(DFM_JOINT_SLIDER, 0, DFM_RIGID_WORLD, {}, {0, 0, 1});
  j.motor = 1;
  j.velocity = 0.5;
  j.max = 15;
  const dfm_rigid r = create(w, {box("lift", {0.1, 0.1, 0.1}, 2)}, {j})[0];
  run(w, 0.5, 1e-3);
  double rate = 0, effort = 0;
  test::ok(dfm_rigid_joint(r, 0, nullptr, &rate, &effort));
  EXPECT_NEAR(rate, (15 - 2 * 9.81) / 2 * 0.5, 1e-9);
  EXPECT_NEAR(effort, 15, 1e-12);
  test::ok(dfm_rigid_set_motor(r, 0, 0.5, 60));
  run(w, 0.5, 1e-3);
  test::ok(dfm_rigid_joint(r, 0, nullptr, &rate, &effort));
  EXPECT_NEAR(rate, 0.5, 1e-12);
  EXPECT_NEAR(effort, 2 * 9.81, 1e-9);
}

// A torque about a hinge: a = M / I; and the joint between two free bodies gives and takes the same.
TEST(Rigid, HingeMotorBetweenFreeBodies_KeepsMomenta) {
  test::Context c;
  const dfm_world w = test::make_world(c, {0, 0, 0});
  dfm_joint_def j = joint(DFM_JOINT_HINGE, 1, 0, {0.2, 0, 0}, {0, 0, 1});
  j.motor = 1;
  j.velocity = 1e9;
  j.max = 0.02;
  const auto r = create(w, {box("a", {0.2, 0.1, 0.1}, 1), box("b", {0.2, 0.1, 0.05}, 3, {0.4, 0, 0})}, {j});
  run(w, 1, 1e-3);
  double momentum[3] = {}, angular[3] = {};
  for (const dfm_rigid body : r) {
    const dfm_body_measure m = rigid_measure(body);
    for (int k = 0; k < 3; ++k) {
      momentum[k] += m.momentum[k];
      angular[k] += m.angular[k] + m.com[(k + 1) % 3] * m.momentum[(k + 2) % 3] -
                    m.com[(k + 2) % 3] * m.momentum[(k + 1) % 3];
    }
  }
  EXPECT_GT(std::fabs(state(r[1]).spin[2]), 0.1);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(momentum[k], 0, 1e-12);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(angular[k], 0, 1e-6);
}

// A fixed joint makes one body of two: a dumbbell tumbles like the compound body that stands for it.
TEST(Rigid, FixedJoint_MovesAsOneBody) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  const auto r =
      create(w, {box("a", {0.1, 0.1, 0.1}, 1, {-0.3, 0, 0}), box("b", {0.1, 0.1, 0.1}, 1, {0.3, 0, 0})},
             {joint(DFM_JOINT_FIXED, 0, 1, {0, 0, 0})});
  for (int side = 0; side < 2; ++side) {
    dfm_rigid_state s = state(r[size_t(side)]);
    s.spin[2] = 3;
    s.velocity[1] = (side ? 1 : -1) * 0.9;
    test::ok(dfm_rigid_set_state(r[size_t(side)], &s));
  }
  run(w, 1, 1e-3);
  const dfm_rigid_state a = state(r[0]), b = state(r[1]);
  EXPECT_NEAR(
      norm({b.position[0] - a.position[0], b.position[1] - a.position[1], b.position[2] - a.position[2]}),
      0.6, 1e-9);
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(a.rotation[k], b.rotation[k], 1e-9);
  EXPECT_NEAR(0.5 * (a.position[2] + b.position[2]), -9.81 / 2 * (1 + 1e-3), 1e-9);
  const double angle = 2 * std::atan2(a.rotation[2], a.rotation[3]);
  EXPECT_NEAR(angle, 3, 1e-5);
}

// Joints take no speed: about a hinge off its center a body turns on as fast as it was, where projecting its
// velocity would take h w^2 / 2 per second.
TEST(Rigid, JointedBodies_KeepTheirSpeed) {
  test::Context c;
  const dfm_world w = test::make_world(c, {0, 0, 0});
  const dfm_rigid r = create(w, {box("rod", {0.02, 0.03, 0.5}, 2, {0, 0, -0.5})},
                             {joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0, 0, 0}, {0, 1, 0})})[0];
  dfm_rigid_state s = state(r);
  s.velocity[0] = -2;
  s.spin[1] = 4;
  test::ok(dfm_rigid_set_state(r, &s));
  run(w, 0.01, 1e-3);
  const double start = state(r).spin[1];
  run(w, 10, 1e-3);
  EXPECT_NEAR(start, 4, 1e-4);
  EXPECT_NEAR(state(r).spin[1], start, 1e-8);
  EXPECT_NEAR(norm(vec(state(r).position)), 0.5, 1e-9);
}

// A double pendulum that turns over: energy wanders with the step and does not drift.
TEST(Rigid, DoublePendulum_KeepsItsEnergy) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  const auto r = create(
      w,
      {box("upper", {0.02, 0.03, 0.25}, 1, {0.25, 0, 0}), box("lower", {0.02, 0.03, 0.25}, 1, {0.75, 0, 0})},
      {joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0, 0, 0}, {0, 1, 0}),
       joint(DFM_JOINT_HINGE, 1, 0, {0.5, 0, 0}, {0, 1, 0})});
  double least = 1e9, most = -1e9, mean_early = 0, mean_late = 0;
  for (int k = 0; k < 20000; ++k) {
    run(w, 5e-4, 5e-4);
    double energy = 0;
    for (const dfm_rigid body : r) {
      const dfm_body_measure m = rigid_measure(body);
      // the velocity is that half a step ago
      energy += m.kinetic + m.mass * 9.81 * (m.com[2] - 0.5 * 5e-4 * m.velocity[2]);
    }
    least = std::min(least, energy);
    most = std::max(most, energy);
    (k < 2000 ? mean_early : k >= 18000 ? mean_late : energy) += energy / 2000;
  }
  const double swing = 9.81 * 2 * 0.5;  // J, what it falls through
  EXPECT_LT(most - least, 0.02 * swing);
  EXPECT_NEAR(mean_late, mean_early, 2e-3 * swing);
}

// A loop of four bars has one joint equation too many; it must hold all the same.
TEST(Rigid, ClosedLoop_Holds) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  const auto r = create(
      w,
      {box("left", {0.02, 0.02, 0.25}, 1, {0, 0, -0.25}), box("right", {0.02, 0.02, 0.25}, 1, {1, 0, -0.25}),
       box("bar", {0.5, 0.02, 0.02}, 1, {0.5, 0, -0.5})},
      {joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {0, 0, 0}, {0, 1, 0}),
       joint(DFM_JOINT_HINGE, 1, DFM_RIGID_WORLD, {1, 0, 0}, {0, 1, 0}),
       joint(DFM_JOINT_HINGE, 2, 0, {0, 0, -0.5}, {0, 1, 0}),
       joint(DFM_JOINT_HINGE, 2, 1, {1, 0, -0.5}, {0, 1, 0})});
  for (const dfm_rigid body : r) {
    dfm_rigid_state s = state(body);
    s.velocity[0] = body == r[2] ? 0.5 : 0.25;
    if (body != r[2]) s.spin[1] = -1;
    test::ok(dfm_rigid_set_state(body, &s));
  }
  run(w, 2, 1e-3);
  const dfm_rigid_state bar = state(r[2]), left = state(r[0]);
  EXPECT_NEAR(bar.rotation[1], 0, 1e-9);  // stays level
  EXPECT_NEAR(bar.position[0] - 0.5, 2 * left.position[0], 1e-9);
  EXPECT_NEAR(norm(vec(left.position)), 0.25, 1e-9);
}
