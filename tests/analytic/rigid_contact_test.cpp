// Rigid bodies against soft ones: both feel the same impulses, and what rests weighs what it weighs.
#include <gtest/gtest.h>

#include "hold.h"
#include "rigid.h"

namespace {

using namespace test;

double top_of(dfm_body bed) {
  uint32_t n = 0;
  ok(dfm_surface_positions(bed, 0, nullptr, &n));
  std::vector<double> x(3 * n);
  ok(dfm_surface_positions(bed, n, x.data(), &n));
  double top = -1e9;
  for (uint32_t i = 0; i < n; ++i) top = std::max(top, x[3 * i + 2]);
  return top;
}

// A bed, and a plate that a slider presses down on it from `gap` above.
struct Bed {
  Context c;
  dfm_world w;
  dfm_body bed;
  Vec center;
  double top;
  explicit Bed(Vec gravity = {}, double young = 5e4, uint32_t cells = 3)
      : w(make_world(c, gravity)),
        bed(soft_bed(c, w, young, cells)),
        center(vec(measure(bed).com)),
        top(top_of(bed)) {}
  dfm_rigid press(double mass, double gap, double velocity, double max) const {
    dfm_joint_def j = joint(DFM_JOINT_SLIDER, 0, DFM_RIGID_WORLD, {center[0], center[1], top}, {0, 0, -1});
    j.motor = 1;
    j.velocity = velocity;
    j.max = max;
    return create(w, {box("press", {0.2, 0.2, 0.02}, mass, {center[0], center[1], top + 0.02 + gap})},
                  {j})[0];
  }
};

Vec contact_force(dfm_rigid r) {
  Vec force, moment;
  ok(dfm_rigid_contact_wrench(r, force.data(), moment.data()));
  return force;
}
// Up, of the next `steps` steps of 1 ms.
double mean_force(dfm_world w, dfm_rigid r, int steps) {
  double mean = 0;
  for (int k = 0; k < steps; ++k) {
    run(w, 1e-3, 1e-3);
    mean += contact_force(r)[2] / steps;
  }
  return mean;
}

}  // namespace

// Without gravity nothing but the two bodies acts: their momenta together stay what they were, linear and
// angular, while both change a lot.
TEST(RigidContact, Collision_KeepsBothMomenta) {
  Context c;
  const dfm_world w = make_world(c, {0, 0, 0});
  set_friction(w, 0.6);
  const dfm_body ball = soft_ball(c, w, {0, 0, 0.3}, {0.5, 0, -2});
  dfm_rigid_def d = box("plate", {0.15, 0.1, 0.03}, 2, {0.05, 0.02, 0.13});
  d.spin[2] = 4;
  d.velocity[2] = 0.3;
  const dfm_rigid plate = create(w, {d})[0];
  auto momenta = [&] {
    Momenta m;
    add(m, measure(ball));
    add(m, rigid_measure(plate));
    return m;
  };
  const Momenta start = momenta();
  const double before = measure(ball).momentum[2];
  run(w, 0.2, 1e-3);
  const Momenta end = momenta();
  EXPECT_GT(stats(w).contacts_max, 5u);
  EXPECT_GT(std::fabs(measure(ball).momentum[2] - before), 1);
  EXPECT_GT(norm(vec(rigid_measure(plate).contact_impulse)), 1);
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(end.linear[k], start.linear[k], 1e-12 * start.size);
    EXPECT_NEAR(end.angular[k], start.angular[k], 1e-12 * start.size);
    EXPECT_NEAR(rigid_measure(plate).contact_impulse[k], -measure(ball).contact_impulse[k],
                1e-12 * start.size);
  }
}

// What lies on a soft bed is carried with its weight, and lies lower the heavier it is.
TEST(RigidContact, BoxOnBed_IsCarriedByItsWeight) {
  double sag[3];
  const double masses[3] = {2, 4, 8};
  for (int i = 0; i < 3; ++i) {
    const Bed on({0, 0, -9.81});
    const double mass = masses[i];
    const dfm_rigid weight = create(
        on.w, {box("weight", {0.2, 0.2, 0.05}, mass, {on.center[0], on.center[1], on.top + 0.0501})})[0];
    run(on.w, 1.5, 1e-3);
    EXPECT_NEAR(mean_force(on.w, weight, 200), mass * 9.81, 1e-3 * mass * 9.81);
    EXPECT_LT(norm(vec(state(weight).velocity)), 1e-4);
    EXPECT_NEAR(state(weight).rotation[3], 1, 1e-3);
    sag[i] = on.top + 0.05 - state(weight).position[2];
  }
  // Twice the mass, about twice the additional sag; the bed's own weight sags by the same in all three.
  EXPECT_GT(sag[0], 1e-4);
  EXPECT_NEAR((sag[2] - sag[1]) / (sag[1] - sag[0]), 2, 0.2);
}

// The rim of a box presses edges of the bed flat. Those that bear there count on; while they did not, they
// came and went in every third sub-step, took their friction with them, and boxes walked down at 1e-6 to 2e-3
// m/s.
TEST(RigidContact, BoxOnSlopingBed_StaysAndItsContactsToo) {
  for (const char *law : {"coulomb", "lugre", "elastoplastic", "gms"}) {
    Context c;
    const dfm_world w = make_world(c);
    BodyOptions o;
    o.young = 1e5;
    o.damping_stiffness = 0.01;
    const dfm_body bed = make_body(c, w, "beam", {0.3, 0.3, 0.1}, 150, o);
    hold_bottom(bed);
    hold::set_law(w, law);
    const Vec center = vec(measure(bed).com);
    dfm_rigid_def d = box("weight", {0.07, 0.06, 0.05}, 1, {center[0], center[1], top_of(bed) + 0.0501});
    d.pose.rotation[2] = std::sin(0.05);
    d.pose.rotation[3] = std::cos(0.05);
    const dfm_rigid weight = create(w, {d})[0];
    run(w, 0.3, 1e-3);
    for (int i = 1; i <= 100; ++i) {
      const double slope = 0.7 * hold::kMu * i / 100, down = 1 / std::hypot(1, slope);
      const double gravity[3] = {9.81 * slope * down, 0, -9.81 * down};
      ok(dfm_world_set_gravity(w, gravity));
      run(w, 1e-3, 1e-3);
    }
    run(w, 0.8, 1e-3);
    std::vector<dfm_contact_event> events(65536);
    uint32_t n = 0;
    ok(dfm_world_events(w, 65536, events.data(), &n));
    const Vec before = vec(state(weight).position);
    run(w, 0.2, 1e-3);
    EXPECT_LT(apart(before, vec(state(weight).position)) / 0.2, 1e-8) << law;
    ok(dfm_world_events(w, 65536, events.data(), &n));
    EXPECT_EQ(n, 0u) << law << ": contacts that begin or end";
  }
}

// A slider with a motor that can do 5 N presses with 5 N, whatever speed it is told.
TEST(RigidContact, MotorPress_GivesItsForce) {
  const Bed on;
  const dfm_rigid press = on.press(1, 1e-3, 0.2, 5);
  run(on.w, 1.5, 1e-3);
  EXPECT_NEAR(mean_force(on.w, press, 100), 5, 0.01);
  EXPECT_NEAR(reading(press, 0).effort, 5, 1e-9);
}

// A motor with power to spare runs at its speed while contact brakes it, to rounding, and says
// what that takes.
TEST(RigidContact, BrakedMotor_KeepsItsSpeed) {
  const Bed on;
  const dfm_rigid press = on.press(0.1, 5e-4, 0.02, 1e4);
  double most = 0;
  for (int k = 0; k < 500; ++k) {
    run(on.w, 1e-3, 1e-3);
    const JointReading motor = reading(press, 0);
    const double force = contact_force(press)[2];
    ASSERT_NEAR(motor.rate, 0.02, 1e-12) << "step " << k;
    // the first step also brings it up to speed
    ASSERT_NEAR(motor.effort, force, k ? 1e-9 * (1 + force) : 3) << "step " << k;
    most = std::max(most, force);
  }
  EXPECT_GT(most, 20);  // F h / m would be 0.2 m/s: ten times its speed
}

// The limit is met on the way in, and left when the speed is told anew: both within the sub-step, so that
// neither force nor speed is overshot.
TEST(RigidContact, MotorPress_ReachesItsLimitAndLeavesIt) {
  const Bed on;
  const dfm_rigid press = on.press(0.5, 1e-3, 0.05, 8);
  JointReading motor;
  int limited = 0;
  for (int k = 0; k < 1000; ++k) {
    if (k == 800) ok(dfm_rigid_set_motor(press, 0, -0.03, 8));
    run(on.w, 1e-3, 1e-3);
    motor = reading(press, 0);
    ASSERT_LE(std::fabs(motor.effort), 8 * (1 + 1e-12)) << "step " << k;
    const bool at_limit = std::fabs(motor.effort) > 8 * (1 - 1e-9);
    limited += at_limit;
    if (!at_limit) ASSERT_NEAR(motor.rate, k < 800 ? 0.05 : -0.03, 1e-9) << "step " << k;
    // never faster than told
    else
      ASSERT_LE(motor.effort > 0 ? motor.rate : -motor.rate, (k < 800 ? 0.05 : 0.03) + 1e-9) << "step " << k;
  }
  EXPECT_GT(limited, 300);
  EXPECT_NEAR(motor.rate, -0.03, 1e-9);
}

// A heavy rigid body on a light soft one is the hard case of a sequential solve: from landing to rest, at a
// weight of 20 N whatever the mass. Figures in doc/concepts/rigid.md.
TEST(RigidContact, MassRatios_Converge) {
  for (const double ratio : {1.0, 10.0, 100.0, 1000.0}) {
    const double mass = 9 * ratio;  // of the bed's 9 kg
    const Bed on({0, 0, -20 / mass}, 1e5, 8);
    set_friction(on.w, 0.5);
    dfm_rigid_def d = box("weight", {0.12, 0.12, 0.05}, mass, {on.center[0], on.center[1], on.top + 0.051});
    d.velocity[2] = -0.3 / std::sqrt(ratio);
    d.velocity[0] = 0.02 / std::sqrt(ratio);  // the same energy
    create(on.w, {d});
    double sweeps = 0;
    for (int k = 0; k < 500; ++k) {
      run(on.w, 1e-3, 1e-3);
      sweeps += stats(on.w).sweeps / 500.0;
    }
    const dfm_world_stats s = stats(on.w);
    std::printf("  mass ratio %4g: sweeps per step mean %.1f, most %u; not converged %llu of %llu\n", ratio,
                sweeps, s.sweeps_max, static_cast<unsigned long long>(s.unconverged),
                static_cast<unsigned long long>(s.substeps));
    EXPECT_GT(s.contacts_max, 12u);
    EXPECT_LE(s.unconverged, s.substeps / 100);
  }
}
