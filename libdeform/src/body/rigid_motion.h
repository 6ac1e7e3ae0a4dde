// The rigid motion with the momentum and angular momentum of a set of points.
#pragma once
#include <cstdint>

#include "math/vec3.h"

namespace dfm {

struct RigidMotion {
  Vec3 center, velocity, spin;  // m, m/s of the center of mass, rad/s
  Vec3 at(Vec3 x) const { return velocity + cross(spin, x - center); }
};

// place(i), velocity(i): m, m/s of point i; n > 0. Points on a line have no spin about it.
template <class Place, class Velocity>
RigidMotion rigid_motion(uint32_t n, const double *mass, const Place &place, const Velocity &velocity) {
  double all = 0;
  RigidMotion out;
  for (uint32_t i = 0; i < n; ++i) {
    all += mass[i];
    out.center += mass[i] * place(i);
    out.velocity += mass[i] * velocity(i);
  }
  out.center = (1 / all) * out.center;
  out.velocity = (1 / all) * out.velocity;
  Vec3 momentum;
  double s[6] = {};
  for (uint32_t i = 0; i < n; ++i) {
    const Vec3 r = place(i) - out.center;
    momentum += mass[i] * cross(r, velocity(i) - out.velocity);
    const double square = dot(r, r);
    s[0] += mass[i] * (square - r.x * r.x);
    s[1] += mass[i] * (square - r.y * r.y);
    s[2] += mass[i] * (square - r.z * r.z);
    s[3] -= mass[i] * r.y * r.z;
    s[4] -= mass[i] * r.z * r.x;
    s[5] -= mass[i] * r.x * r.y;
  }
  const Vec3 a{s[0], s[5], s[4]}, c{s[5], s[1], s[3]}, e{s[4], s[3], s[2]};
  const double det = dot(a, cross(c, e));
  if (det > 0)
    out.spin = (1 / det) * (momentum.x * cross(c, e) + momentum.y * cross(e, a) + momentum.z * cross(a, c));
  return out;
}

}  // namespace dfm
