// The rotation of points that a sub-step moves along chords.
#pragma once
#include "body/phyxels.h"
#include "body/rigid_motion.h"

namespace dfm {

struct Turning {
  Vec3 velocity, spin;  // m/s of the center of mass, rad/s
  double half = 0;      // s, of the sub-step
  // The difference between a point's velocity at the end of its arc and the mean one, which is that of the
  // chord. m/s
  Vec3 arc(Vec3 v) const { return half * cross(spin, v - velocity); }
};

// The rotation that has the angular momentum of the mean velocities way [npoint,4] at the middle of the
// chords: with it chords of a rotation by the angle a, whose spin here is 2 tan(a/2) / h, become exactly
// tangents of the arcs.
inline Turning turning_of(const Phyxels &p, const double *way, double h) {
  const auto velocity = [&](uint32_t i) { return load3(way + size_t(i) * kStride); };
  const auto middle = [&](uint32_t i) { return load3(&p.x[size_t(i) * kStride]) + 0.5 * h * velocity(i); };
  const RigidMotion motion = rigid_motion(p.n, p.mass.data(), middle, velocity);
  return {motion.velocity, motion.spin, 0.5 * h};
}

}  // namespace dfm
