// Vectors and calls that the tests of tools share.
#pragma once
#include "deform/tool.h"
#include "rigid.h"

namespace test::tools {

using test::cross;

inline Vec rotate(const double q[4], Vec v) {
  const Vec u = {q[0], q[1], q[2]}, t = cross(u, v), s = cross(u, t);
  return {v[0] + 2 * (q[3] * t[0] + s[0]), v[1] + 2 * (q[3] * t[1] + s[1]), v[2] + 2 * (q[3] * t[2] + s[2])};
}

// About the axis, rad.
inline dfm_pose pose(Vec at, Vec axis = {0, 0, 1}, double angle = 0) {
  const double s = std::sin(0.5 * angle) / test::norm(axis);
  return {{at[0], at[1], at[2]}, {s * axis[0], s * axis[1], s * axis[2], std::cos(0.5 * angle)}};
}

// Two jaws, of these half sizes, without a shaft. opening: rad.
inline dfm_tool_def grasper(Vec half, double opening, const dfm_pose &at) {
  dfm_tool_def d = dfm_tool_def_default();
  d.name = "grasper";
  d.shape = DFM_TOOL_GRASPER;
  for (size_t k = 0; k < 3; ++k) d.half_size[k] = half[k];
  d.radius = 0;
  d.opening = opening;
  d.pose = at;
  return d;
}

// The triangles of a box, and the def that has them.
struct BoxMesh {
  double points[24];
  uint32_t triangles[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                            2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  explicit BoxMesh(Vec half) {
    for (size_t i = 0; i < 8; ++i)
      for (size_t k = 0; k < 3; ++k) points[3 * i + k] = (i >> k & 1 ? 1 : -1) * half[k];
  }
  void put(dfm_tool_def &d) const {
    d.shape = DFM_TOOL_MESH;
    put_triangles(d);
  }
  void put(dfm_obstacle_def &d) const {
    d.shape = DFM_SHAPE_MESH;
    put_triangles(d);
  }

 private:
  template <class Def>
  void put_triangles(Def &d) const {
    d.npoint = 8;
    d.ntriangle = 12;
    d.points = points;
    d.triangles = triangles;
  }
};

// A soft cube of 40 mm, its top in the plane z = 0; damping_mass: 1/s.
inline dfm_body soft_block(dfm_context *c, dfm_world w, double damping_mass = 0) {
  test::BodyOptions o;
  o.young = 3e4;
  o.damping_stiffness = 2e-3;
  o.damping_mass = damping_mass;
  o.position = {-0.02, -0.02, -0.04};
  return test::make_body(c, w, "beam", {0.04, 0.04, 0.04}, 250, o);
}

inline dfm_tool make(dfm_world w, const dfm_tool_def &d) {
  dfm_tool t = 0;
  test::ok(dfm_tool_create(w, &d, &t));
  return t;
}

inline dfm_tool_state state(dfm_tool t) {
  dfm_tool_state s{};
  s.size = sizeof s;
  test::ok(dfm_tool_get_state(t, &s));
  return s;
}

inline Vec force_on(dfm_tool t) {
  double force[3], torque[3];
  test::ok(dfm_tool_force(t, force, torque));
  return rotate(state(t).pose.rotation, test::vec(force));
}

// J, in its motion and in the coupling to its device.
inline double tool_energy(dfm_tool t) {
  dfm_tool_def d = dfm_tool_def_default();
  test::ok(dfm_tool_get_def(t, &d));
  const dfm_tool_state s = state(t);
  double motion = 0, spring = 0, same = 0;
  for (int k = 0; k < 3; ++k) {
    motion += d.mass * s.velocity[k] * s.velocity[k] + d.inertia * s.spin[k] * s.spin[k];
    spring += d.stiffness * std::pow(s.device.position[k] - s.pose.position[k], 2);
  }
  for (int k = 0; k < 4; ++k) same += s.device.rotation[k] * s.pose.rotation[k];
  const double angle = 2 * std::acos(std::min(std::fabs(same), 1.0));
  return 0.5 * (motion + spring + d.turn_stiffness * angle * angle);
}

}  // namespace test::tools
