// Rigid bodies against soft ones: both feel the same impulses, and what rests weighs what it weighs.
#include <gtest/gtest.h>

#include "rigid.h"

namespace {

using namespace test;

struct Momenta { double linear[3] = {}, angular[3] = {}, size = 0; };

// Of all bodies, about the origin; size: the sum of the bodies' own, to compare with.
void add(Momenta &to, const dfm_body_measure &m) {
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    to.linear[k] += m.momentum[k];
    to.angular[k] += m.angular[k] + m.com[i] * m.momentum[j] - m.com[j] * m.momentum[i];
  }
  to.size += norm(vec(m.momentum));
}

dfm_body soft_ball(dfm_context *c, dfm_world w, Vec position, Vec velocity = {}) {
  BodyOptions o;
  o.name = "ball", o.young = 3e4, o.poisson = 0.3, o.damping_stiffness = 0.002, o.position = position, o.velocity = velocity;
  return make_body(c, w, "ball", {0.1}, 400, o);
}

dfm_body soft_bed(dfm_context *c, dfm_world w, double young, uint32_t cells = 3) {
  BodyOptions o;
  o.name = "bed", o.young = young, o.poisson = 0.3, o.damping_stiffness = 0.003, o.damping_mass = 4;
  return make_body(c, w, "beam", {0.3, 0.3, 0.1}, cells, o);
}

void hold_bottom(dfm_body bed) {
  dfm_body_info info{};
  info.size = sizeof info;
  ok(dfm_body_get_info(bed, &info));
  std::vector<double> x(3 * info.npoint);
  uint32_t n = 0;
  ok(dfm_body_get_state(bed, info.npoint, x.data(), nullptr, &n));
  double low = 1e9;
  for (uint32_t i = 0; i < n; ++i) low = std::min(low, x[3 * i + 2]);
  std::vector<uint32_t> held;
  for (uint32_t i = 0; i < n; ++i)
    if (x[3 * i + 2] < low + 1e-9) held.push_back(i);
  ok(dfm_body_hold(bed, uint32_t(held.size()), held.data(), 7));
}

double top_of(dfm_body bed) {
  uint32_t n = 0;
  ok(dfm_surface_positions(bed, 0, nullptr, &n));
  std::vector<double> x(3 * n);
  ok(dfm_surface_positions(bed, n, x.data(), &n));
  double top = -1e9;
  for (uint32_t i = 0; i < n; ++i) top = std::max(top, x[3 * i + 2]);
  return top;
}

}  // namespace

// Without gravity nothing but the two bodies acts: their momenta together stay what they were, linear and angular, while both change a lot.
TEST(RigidContact, Collision_KeepsBothMomenta) {
  Context c;
  const dfm_world w = make_world(c, {0, 0, 0});
  set_friction(w, 0.6);
  const dfm_body ball = soft_ball(c, w, {0, 0, 0.3}, {0.5, 0, -2});
  dfm_rigid_def d = box("plate", {0.15, 0.1, 0.03}, 2, {0.05, 0.02, 0.13});
  d.spin[2] = 4, d.velocity[2] = 0.3;
  const dfm_rigid plate = create(w, {d})[0];
  auto momenta = [&] {
    Momenta m;
    add(m, measure(ball)), add(m, rigid_measure(plate));
    return m;
  };
  const Momenta start = momenta();
  const double before = measure(ball).momentum[2];
  run(w, 0.2, 1e-3);
  const Momenta end = momenta();
  EXPECT_GT(stats(w).contacts_max, 5u);
  EXPECT_GT(std::fabs(measure(ball).momentum[2] - before), 1);
  EXPECT_GT(norm(vec(rigid_measure(plate).contact_impulse)), 1);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(end.linear[k], start.linear[k], 1e-12 * start.size);
    EXPECT_NEAR(end.angular[k], start.angular[k], 1e-12 * start.size);
    EXPECT_NEAR(rigid_measure(plate).contact_impulse[k], -measure(ball).contact_impulse[k], 1e-12 * start.size);
  }
}

// What lies on a soft bed is carried with its weight, and lies lower the heavier it is.
TEST(RigidContact, BoxOnBed_IsCarriedByItsWeight) {
  double sag[3];
  const double masses[3] = {2, 4, 8};
  for (int i = 0; i < 3; ++i) {
    Context c;
    const dfm_world w = make_world(c);
    const dfm_body bed = soft_bed(c, w, 5e4);
    hold_bottom(bed);
    const double top = top_of(bed), mass = masses[i];
    double centre[3];
    std::copy_n(measure(bed).com, 3, centre);
    const dfm_rigid weight = create(w, {box("weight", {0.2, 0.2, 0.05}, mass, {centre[0], centre[1], top + 0.0501})})[0];
    double force[3] = {}, moment[3] = {}, mean = 0;
    run(w, 1.5, 1e-3);
    for (int k = 0; k < 200; ++k) {
      run(w, 1e-3, 1e-3);
      ok(dfm_rigid_contact_wrench(weight, force, moment));
      mean += force[2] / 200;
    }
    EXPECT_NEAR(mean, mass * 9.81, 1e-3 * mass * 9.81);
    EXPECT_LT(norm(vec(state(weight).velocity)), 1e-4);
    EXPECT_NEAR(state(weight).rotation[3], 1, 1e-3);
    sag[i] = top + 0.05 - state(weight).position[2];
  }
  // Twice the mass, about twice the additional sag; the bed's own weight sags by the same in all three.
  EXPECT_GT(sag[0], 1e-4);
  EXPECT_NEAR((sag[2] - sag[1]) / (sag[1] - sag[0]), 2, 0.2);
}

// A slider with a motor that can do 5 N presses with 5 N, whatever speed it is told.
TEST(RigidContact, MotorPress_GivesItsForce) {
  Context c;
  const dfm_world w = make_world(c, {0, 0, 0});
  const dfm_body bed = soft_bed(c, w, 5e4);
  hold_bottom(bed);
  double centre[3];
  std::copy_n(measure(bed).com, 3, centre);
  const double top = top_of(bed);
  dfm_joint_def j = joint(DFM_JOINT_SLIDER, 0, DFM_RIGID_WORLD, {centre[0], centre[1], top}, {0, 0, -1});
  j.motor = 1, j.velocity = 0.2, j.max = 5;
  const dfm_rigid press = create(w, {box("press", {0.2, 0.2, 0.02}, 1, {centre[0], centre[1], top + 0.021})}, {j})[0];
  run(w, 1.5, 1e-3);
  double force[3] = {}, moment[3] = {}, effort = 0, mean = 0;
  for (int k = 0; k < 100; ++k) {
    run(w, 1e-3, 1e-3);
    ok(dfm_rigid_contact_wrench(press, force, moment));
    mean += force[2] / 100;
  }
  ok(dfm_rigid_joint(press, 0, nullptr, nullptr, &effort));
  EXPECT_NEAR(effort, 5, 1e-9);
  EXPECT_NEAR(mean, 5, 0.01);
}

// A motor with power to spare runs at its speed while contact brakes it, to rounding, and says what that takes.
TEST(RigidContact, BrakedMotor_KeepsItsSpeed) {
  Context c;
  const dfm_world w = make_world(c, {0, 0, 0});
  const dfm_body bed = soft_bed(c, w, 5e4);
  hold_bottom(bed);
  double centre[3];
  std::copy_n(measure(bed).com, 3, centre);
  const double top = top_of(bed);
  dfm_joint_def j = joint(DFM_JOINT_SLIDER, 0, DFM_RIGID_WORLD, {centre[0], centre[1], top}, {0, 0, -1});
  j.motor = 1, j.velocity = 0.02, j.max = 1e4;
  const dfm_rigid press = create(w, {box("press", {0.2, 0.2, 0.02}, 0.1, {centre[0], centre[1], top + 0.0205})}, {j})[0];
  double force[3] = {}, moment[3] = {}, rate = 0, effort = 0, most = 0;
  for (int k = 0; k < 500; ++k) {
    run(w, 1e-3, 1e-3);
    ok(dfm_rigid_joint(press, 0, nullptr, &rate, &effort));
    ok(dfm_rigid_contact_wrench(press, force, moment));
    ASSERT_NEAR(rate, 0.02, 1e-12) << "step " << k;
    ASSERT_NEAR(effort, force[2], k ? 1e-9 * (1 + force[2]) : 3) << "step " << k;   // the first step also brings it up to speed
    most = std::max(most, force[2]);
  }
  EXPECT_GT(most, 20);   // F h / m would be 0.2 m/s: ten times its speed
}

// The limit is met on the way in, and left when the speed is told anew: both within the sub-step, so that neither force nor speed is overshot.
TEST(RigidContact, MotorPress_ReachesItsLimitAndLeavesIt) {
  Context c;
  const dfm_world w = make_world(c, {0, 0, 0});
  const dfm_body bed = soft_bed(c, w, 5e4);
  hold_bottom(bed);
  double centre[3];
  std::copy_n(measure(bed).com, 3, centre);
  const double top = top_of(bed);
  dfm_joint_def j = joint(DFM_JOINT_SLIDER, 0, DFM_RIGID_WORLD, {centre[0], centre[1], top}, {0, 0, -1});
  j.motor = 1, j.velocity = 0.05, j.max = 8;
  const dfm_rigid press = create(w, {box("press", {0.2, 0.2, 0.02}, 0.5, {centre[0], centre[1], top + 0.021})}, {j})[0];
  double rate = 0, effort = 0;
  int limited = 0;
  for (int k = 0; k < 1000; ++k) {
    if (k == 800) ok(dfm_rigid_set_motor(press, 0, -0.03, 8));
    run(w, 1e-3, 1e-3);
    ok(dfm_rigid_joint(press, 0, nullptr, &rate, &effort));
    ASSERT_LE(std::fabs(effort), 8 * (1 + 1e-12)) << "step " << k;
    const bool at_limit = std::fabs(effort) > 8 * (1 - 1e-9);
    limited += at_limit;
    if (!at_limit) ASSERT_NEAR(rate, k < 800 ? 0.05 : -0.03, 1e-9) << "step " << k;
    else ASSERT_LE(effort > 0 ? rate : -rate, (k < 800 ? 0.05 : 0.03) + 1e-9) << "step " << k;   // never faster than told
  }
  EXPECT_GT(limited, 300);
  EXPECT_NEAR(rate, -0.03, 1e-9);
}

// A heavy rigid body on a light soft one is the hard case of a sequential solve: from landing to rest, at a weight of 20 N whatever the mass.
// Figures in doc/concepts/rigid.md.
TEST(RigidContact, MassRatios_Converge) {
  for (const double ratio : {1.0, 10.0, 100.0, 1000.0}) {
    Context c;
    const double mass = 9 * ratio;   // of the bed's 9 kg
    const dfm_world w = make_world(c, {0, 0, -20 / mass});
    set_friction(w, 0.5);
    const dfm_body bed = soft_bed(c, w, 1e5, 8);
    hold_bottom(bed);
    double centre[3];
    std::copy_n(measure(bed).com, 3, centre);
    dfm_rigid_def d = box("weight", {0.12, 0.12, 0.05}, mass, {centre[0], centre[1], top_of(bed) + 0.051});
    d.velocity[2] = -0.3 / std::sqrt(ratio), d.velocity[0] = 0.02 / std::sqrt(ratio);   // the same energy
    create(w, {d});
    double sweeps = 0;
    for (int k = 0; k < 500; ++k) {
      run(w, 1e-3, 1e-3);
      sweeps += stats(w).sweeps / 500.0;
    }
    const dfm_world_stats s = stats(w);
    std::printf("  mass ratio %4g: sweeps per step mean %.1f, most %u; not converged %llu of %llu\n", ratio, sweeps, s.sweeps_max,
                static_cast<unsigned long long>(s.unconverged), static_cast<unsigned long long>(s.substeps));
    EXPECT_GT(s.contacts_max, 12u);
    EXPECT_LE(s.unconverged, s.substeps / 100);
  }
}
