// The rigid motion with the momentum and angular momentum of a set of points.
#pragma once
#include <cstdint>

#include "math/vec3.h"

namespace dfm {

struct RigidMotion {
  Vec3 center, velocity, spin;  // m, m/s of the center of mass, rad/s
  double mass = 0;              // kg
  Vec3 turns[3] = {};           // 1/(kg m2), columns of the inverse inertia; zero without a spin
  Vec3 at(Vec3 x) const { return velocity + cross(spin, x - center); }
  // 1/kg, what a unit impulse along n at x changes of the velocity there along n
  double response(Vec3 x, Vec3 n) const {
    const Vec3 arm = cross(x - center, n);
    return 1 / mass + dot(arm, arm.x * turns[0] + arm.y * turns[1] + arm.z * turns[2]);
  }
};

// place(i), velocity(i): m, m/s of point i; n > 0.
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
  out.mass = all;
  const double mean = (s[0] + s[1] + s[2]) / 3;
  if (!(mean > 0)) return out;
  // Points are on a line where the determinant is below this part of the cube of the mean: a spin about it
  // moves nothing, and the inverse is that of an inertia about it of this part of the mean.
  constexpr double kOnALine = 1e-9;
  const auto det_of = [&] {
    return dot(Vec3{s[0], s[5], s[4]}, cross(Vec3{s[5], s[1], s[3]}, Vec3{s[4], s[3], s[2]}));
  };
  if (!(det_of() > kOnALine * mean * mean * mean))
    for (int k = 0; k < 3; ++k) s[k] += kOnALine * mean;
  const Vec3 a{s[0], s[5], s[4]}, c{s[5], s[1], s[3]}, e{s[4], s[3], s[2]};
  const double det = det_of();
  const Vec3 ce = cross(c, e), ea = cross(e, a), ac = cross(a, c);
  out.spin = (1 / det) * (momentum.x * ce + momentum.y * ea + momentum.z * ac);
  out.turns[0] = (1 / det) * ce;
  out.turns[1] = (1 / det) * ea;
  out.turns[2] = (1 / det) * ac;
  return out;
}

}  // namespace dfm
