// Rigid bodies that several tests make through the public API.
#pragma once
#include "world.h"

namespace test {

using Vec = std::array<double, 3>;

inline double dot(Vec a, Vec b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline double norm(Vec a) { return std::sqrt(dot(a, a)); }
inline Vec vec(const double *p) { return {p[0], p[1], p[2]}; }

inline dfm_rigid_def box(const char *name, Vec half, double mass, Vec position = {}) {
  dfm_rigid_def d = dfm_rigid_def_default();
  d.name = name, d.shape = DFM_SHAPE_BOX, d.mass = mass;
  for (int k = 0; k < 3; ++k) d.half_size[k] = half[size_t(k)], d.pose.position[k] = position[size_t(k)];
  return d;
}

inline dfm_joint_def joint(uint32_t type, uint32_t body, uint32_t with, Vec anchor, Vec axis = {0, 0, 1}) {
  dfm_joint_def j{};
  j.size = sizeof j, j.type = type, j.body = body, j.with = with;
  for (int k = 0; k < 3; ++k) j.anchor[k] = anchor[size_t(k)], j.axis[k] = axis[size_t(k)];
  return j;
}

inline std::vector<dfm_rigid> create(dfm_world w, const std::vector<dfm_rigid_def> &bodies, const std::vector<dfm_joint_def> &joints = {},
                                     const char *host = nullptr) {
  std::vector<dfm_rigid> out(bodies.size());
  const dfm_rigid_set_def set = {sizeof set, uint32_t(bodies.size()), uint32_t(joints.size()), 0, bodies.data(), joints.data(), nullptr};
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

}  // namespace test
