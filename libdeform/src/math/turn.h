// Rotations and poses: interpolation, exponential map and its inverse, and the mean spin of a rigid body
// that conserves angular momentum over a step. Uses + - * / sqrt only.
#pragma once
#include <algorithm>
#include <cmath>

#include "deform/math.h"
#include "math/elementary.h"
#include "math/vec3.h"

namespace dfm {

inline Quat unit(Quat q) {
  const double n = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  return {q.x / n, q.y / n, q.z / n, q.w / n};
}
inline Quat conjugate(Quat q) { return {-q.x, -q.y, -q.z, q.w}; }
inline Quat load_quat(const double *q) { return {q[0], q[1], q[2], q[3]}; }
inline void store_quat(double *to, Quat q) {
  to[0] = q.x;
  to[1] = q.y;
  to[2] = q.z;
  to[3] = q.w;
}

struct Pose {
  Vec3 position;
  Quat rotation;
};
inline Vec3 place(const Pose &pose, Vec3 x) { return rotate(pose.rotation, x) + pose.position; }
inline Pose operator*(const Pose &a, const Pose &b) {
  return {place(a, b.position), a.rotation * b.rotation};
}
inline Pose to_pose(const dfm_pose &p) { return {load3(p.position), unit_quat(p.rotation)}; }
// Reads a dfm_pose or a dfm_rigid_state, with the rotation as it is.
template <class State>
Pose load_pose(const State &s) {
  return {load3(s.position), load_quat(s.rotation)};
}
template <class State>
void store_pose(State &to, const Pose &p) {
  store3(to.position, p.position);
  store_quat(to.rotation, p.rotation);
}

// The quaternion of a rotation matrix (row-major), from its largest component, which avoids cancellation
// (Shepperd 1978).
inline Quat quat_of(const double *r) {
  const double trace = r[0] + r[4] + r[8];
  Quat q{r[7] - r[5], r[2] - r[6], r[3] - r[1], 1 + trace};
  if (trace < r[0] && r[0] >= r[4] && r[0] >= r[8])
    q = {1 + (r[0] - r[4] - r[8]), r[1] + r[3], r[2] + r[6], r[7] - r[5]};
  else if (trace < r[4] && r[4] >= r[8])
    q = {r[1] + r[3], 1 + (r[4] - r[0] - r[8]), r[5] + r[7], r[2] - r[6]};
  else if (trace < r[8]) q = {r[2] + r[6], r[5] + r[7], 1 + (r[8] - r[0] - r[4]), r[3] - r[1]};
  return unit(q);
}

// Interpolates from a to b along the shorter arc, s in [0,1]. Halving the arc needs square roots only: the
// midpoint of two unit quaternions is their normalized sum. 52 halvings follow the bits of s.
inline Quat slerp(Quat a, Quat b, double s) {
  if (a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w < 0) b = {-b.x, -b.y, -b.z, -b.w};
  for (int bit = 0; bit < 52 && s > 0; ++bit) {
    const Quat mid = unit({a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w});
    s *= 2;
    if (s >= 1) {
      a = mid;
      s -= 1;
    } else {
      b = mid;
    }
  }
  return a;
}

// q turned by the rotation vector r (world frame, rad).
inline Quat turned(Quat q, Vec3 r) {
  const double angle = norm(r);
  if (!(angle > 0)) return q;
  const double half = angle / (2 * 3.14159265358979323846);  // half the angle, over pi
  const Vec3 v = (dfm_sinpi(half) / angle) * r;
  return unit(Quat{v.x, v.y, v.z, dfm_cospi(half)} * q);
}

// The rotation vector of q along the shorter arc. Halving the arc needs square roots only; asin by its series
// is exact to rounding where it is small enough, that is at once for the turn of a sub-step, after five
// halvings for the longest arc.
inline Vec3 rotation_vector(Quat q) {
  if (q.w < 0) q = {-q.x, -q.y, -q.z, -q.w};
  double scale = 2;
  for (int i = 0; i < 5 && q.x * q.x + q.y * q.y + q.z * q.z > 1e-3; ++i) {
    q = unit({q.x, q.y, q.z, q.w + 1});
    scale *= 2;
  }
  const Vec3 v{q.x, q.y, q.z};
  const double s = norm2(v);
  return (scale * (1 + s * (1.0 / 6 + s * (3.0 / 40 + s * (15.0 / 336 + s * (105.0 / 3456)))))) * v;
}

// I v and I^-1 v for principal moments (or their inverses) about the axes of q, in the world frame.
inline Vec3 in_axes(Quat q, Vec3 diagonal, Vec3 v) {
  const Vec3 b = rotate_back(q, v);
  return rotate(q, {diagonal.x * b.x, diagonal.y * b.y, diagonal.z * b.z});
}

// Mean spin w over a step with constant angular momentum L: w = I^-1(q_m) L with q_m half way, q_m = exp(h w
// / 2) q (the midpoint Lie scheme; Krysl 2005, IJNME 63:2171). L is conserved whatever w is, so the spin is
// bounded; fixed-point steps converge while h |w| is below about 1, and a round body needs none.
inline Vec3 mean_spin(Quat q, Vec3 inverse_moments, Vec3 L, double h) {
  Vec3 w = in_axes(q, inverse_moments, L);
  if (inverse_moments.x == inverse_moments.y && inverse_moments.y == inverse_moments.z) return w;
  for (int k = 0; k < 60; ++k) {
    const Vec3 next = in_axes(turned(q, (0.5 * h) * w), inverse_moments, L), change = next - w;
    w = next;
    if (norm2(change) <= 1e-31 * norm2(w)) break;
  }
  return w;
}

// As mean_spin(); where that turns by more than half a radian, what leads to the end of parts of a tenth,
// one after the other: over a radian its fixed point does not converge, and its energy is anything up to
// L^2 / 2 of the least moment.
inline Vec3 free_spin(Quat q, Vec3 inverse_moments, Vec3 L, double h) {
  constexpr double kWhole = 0.5, kPart = 0.1;  // rad
  constexpr double kMaxParts = 4096;
  const bool round = inverse_moments.x == inverse_moments.y && inverse_moments.y == inverse_moments.z;
  const double turn = h * norm(in_axes(q, inverse_moments, L));
  if (round || !(turn > kWhole)) return mean_spin(q, inverse_moments, L, h);
  const double parts = std::min(std::ceil(turn / kPart), kMaxParts), part = h / parts;
  Quat at = q;
  for (double k = 0; k < parts; ++k) at = turned(at, part * mean_spin(at, inverse_moments, L, part));
  return (1 / h) * rotation_vector(at * conjugate(q));
}

}  // namespace dfm
