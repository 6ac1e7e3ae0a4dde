// Vectors and quaternions of the adapters: public headers have none.
#pragma once
#include <cmath>

namespace dfm_rigid_detail {

struct Vec { double x = 0, y = 0, z = 0; };
inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(double s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(Vec a, Vec b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline bool is_none(Vec a) { return a.x == 0 && a.y == 0 && a.z == 0; }
inline double norm(Vec a) { return std::sqrt(dot(a, a)); }
inline Vec load(const double *p) { return {p[0], p[1], p[2]}; }
inline void store(double *p, Vec a) {
  p[0] = a.x;
  p[1] = a.y;
  p[2] = a.z;
}

struct Quat { double x = 0, y = 0, z = 0, w = 1; };
inline Quat operator*(Quat a, Quat b) {
  return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
          a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}
inline Quat load_quat(const double *p) { return {p[0], p[1], p[2], p[3]}; }
inline Quat conjugate(Quat q) { return {-q.x, -q.y, -q.z, q.w}; }
inline Quat unit(Quat q) {
  const double n = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  return {q.x / n, q.y / n, q.z / n, q.w / n};
}
inline Vec rotate(Quat q, Vec v) {
  const Vec u{q.x, q.y, q.z}, t = 2.0 * cross(u, v);
  return v + q.w * t + cross(u, t);
}

// sin(a)/a and cos(a) for the small turns of one sub-step, by series to rounding below 0.5, else by halving
// the angle: + - * / only, so that a run has the same bits whatever libm offers.
inline Quat turn_by(Vec r) {
  int halvings = 1;
  Vec half = 0.5 * r;
  if (!std::isfinite(r.x + r.y + r.z)) return {NAN, NAN, NAN, NAN};
  for (; dot(half, half) > 0.0625; ++halvings) half = 0.5 * half;
  const double s = dot(half, half);
  const double sine = 1 - s / 6 * (1 - s / 20 * (1 - s / 42 * (1 - s / 72 * (1 - s / 110 * (1 - s / 156)))));
  const double cosine =
      1 - s / 2 * (1 - s / 12 * (1 - s / 30 * (1 - s / 56 * (1 - s / 90 * (1 - s / 132 * (1 - s / 182))))));
  Quat q{sine * half.x, sine * half.y, sine * half.z, cosine};
  for (; halvings > 1; --halvings) q = q * q;
  return unit(q);
}
// The rotation vector of a turn along the shorter arc; asin by its series, of an arc that is halved until it
// is short, five times at most.
inline Vec turn_of(Quat q) {
  if (q.w < 0) q = {-q.x, -q.y, -q.z, -q.w};
  double scale = 2;
  for (int i = 0; i < 5 && q.x * q.x + q.y * q.y + q.z * q.z > 1e-3; ++i) {
    q = unit({q.x, q.y, q.z, q.w + 1});
    scale *= 2;
  }
  const Vec v{q.x, q.y, q.z};
  const double s = dot(v, v);
  return (scale * (1 + s * (1.0 / 6 + s * (3.0 / 40 + s * (15.0 / 336 + s * (105.0 / 3456)))))) * v;
}

inline Vec inverse(Vec a) { return {1 / a.x, 1 / a.y, 1 / a.z}; }
inline Vec each(Vec a, Vec b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

struct Pose {
  Vec position;
  Quat rotation;
};
inline Pose operator*(const Pose &a, const Pose &b) {
  return {a.position + rotate(a.rotation, b.position), unit(a.rotation * b.rotation)};
}
inline Pose inverse(const Pose &a) {
  return {rotate(conjugate(a.rotation), -1.0 * a.position), conjugate(a.rotation)};
}

// D v with D diagonal in the axes of q; of cubes and balls all axes are alike.
inline Vec in_axes(Quat q, Vec d, Vec v) {
  if (d.x == d.y && d.y == d.z) return d.x * v;
  const Vec b = rotate(conjugate(q), v);
  return rotate(q, {d.x * b.x, d.y * b.y, d.z * b.z});
}

}  // namespace dfm_rigid_detail
