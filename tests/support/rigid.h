// Rigid bodies that several tests make through the public API.
#pragma once
#include "vec.h"
#include "world.h"

namespace test {

inline dfm_rigid_def box(const char *name, Vec half, double mass, Vec position = {}) {
  dfm_rigid_def d = dfm_rigid_def_default();
  d.name = name;
  d.shape = DFM_SHAPE_BOX;
  d.mass = mass;
  for (int k = 0; k < 3; ++k) {
    d.half_size[k] = half[size_t(k)];
    d.pose.position[k] = position[size_t(k)];
  }
  return d;
}

inline dfm_joint_def joint(uint32_t type, uint32_t body, uint32_t with, Vec anchor, Vec axis = {0, 0, 1}) {
  dfm_joint_def j{};
  j.size = sizeof j;
  j.type = type;
  j.body = body;
  j.with = with;
  for (int k = 0; k < 3; ++k) {
    j.anchor[k] = anchor[size_t(k)];
    j.axis[k] = axis[size_t(k)];
  }
  return j;
}

inline std::vector<dfm_rigid> create(dfm_world w, const std::vector<dfm_rigid_def> &bodies,
                                     const std::vector<dfm_joint_def> &joints = {},
                                     const char *host = nullptr) {
  std::vector<dfm_rigid> out(bodies.size());
  const dfm_rigid_set_def set = {
      sizeof set, uint32_t(bodies.size()), uint32_t(joints.size()), 0, bodies.data(), joints.data(), nullptr};
  ok(dfm_rigid_create(w, host, &set, out.data()));
  return out;
}

inline dfm_rigid_state state(dfm_rigid r) {
  dfm_rigid_state s{};
  ok(dfm_rigid_get_state(r, &s));
  return s;
}

struct JointReading {
  double position = 0, rate = 0, effort = 0;
  bool operator==(const JointReading &) const = default;
};
inline JointReading reading(dfm_rigid r, uint32_t joint) {
  JointReading j;
  ok(dfm_rigid_joint(r, joint, &j.position, &j.rate, &j.effort));
  return j;
}

inline dfm_body_measure rigid_measure(dfm_rigid r) {
  dfm_body_measure m{};
  m.size = sizeof m;
  ok(dfm_rigid_get_measure(r, &m));
  return m;
}

// angular: about the origin; size: sum of the bodies' own
struct Momenta {
  Vec linear{}, angular{};
  double size = 0;
};

inline void add(Momenta &to, Vec momentum, Vec center, Vec spin) {
  for (size_t k = 0; k < 3; ++k) {
    const size_t i = (k + 1) % 3, j = (k + 2) % 3;
    to.linear[k] += momentum[k];
    to.angular[k] += spin[k] + center[i] * momentum[j] - center[j] * momentum[i];
  }
  to.size += norm(momentum);
}
inline void add(Momenta &to, const dfm_body_measure &m) {
  add(to, vec(m.momentum), vec(m.com), vec(m.angular));
}

// What rigid bodies fall on: a ball of 0.1 m, a bed of 0.3 by 0.3 by 0.1 m with its bottom held.
inline std::vector<double> points(dfm_body b) { return State(b).x; }
inline double lowest(dfm_body b) {
  double low = 1e9;
  const std::vector<double> x = points(b);
  for (size_t i = 2; i < x.size(); i += 3) low = std::min(low, x[i]);
  return low;
}
inline void hold_bottom(dfm_body bed) {
  const std::vector<double> x = points(bed);
  const double low = lowest(bed);
  std::vector<uint32_t> held;
  for (uint32_t i = 0; i < x.size() / 3; ++i)
    if (x[3 * size_t{i} + 2] < low + 1e-9) held.push_back(i);
  ok(dfm_body_hold(bed, uint32_t(held.size()), held.data(), 7));
}
inline dfm_body soft_bed(dfm_context *c, dfm_world w, double young, uint32_t cells = 3) {
  BodyOptions o;
  o.name = "bed";
  o.young = young;
  o.poisson = 0.3;
  o.damping_stiffness = 0.003;
  o.damping_mass = 4;
  const dfm_body bed = make_body(c, w, "beam", {0.3, 0.3, 0.1}, cells, o);
  hold_bottom(bed);
  return bed;
}
inline dfm_body soft_ball(dfm_context *c, dfm_world w, Vec at, Vec speed = {}, double young = 3e4,
                          double damping_mass = 0) {
  BodyOptions o;
  o.name = "ball";
  o.young = young;
  o.poisson = 0.3;
  o.damping_stiffness = 0.002;
  o.damping_mass = damping_mass;
  o.position = at;
  o.velocity = speed;
  return make_body(c, w, "ball", {0.1}, 400, o);
}

inline void go(dfm_world w, double dt, double time) {
  for (int i = 0; i < std::lround(time / dt); ++i)
    ASSERT_EQ(dfm_world_step(w, dt, nullptr), DFM_OK) << dfm_last_error();
}

inline void push(dfm_rigid r, Vec velocity, Vec spin = {}) {
  dfm_rigid_state s = test::state(r);
  std::copy(velocity.begin(), velocity.end(), s.velocity);
  std::copy(spin.begin(), spin.end(), s.spin);
  test::ok(dfm_rigid_set_state(r, &s));
}

}  // namespace test
