// Vectors of three doubles and their operations. No FMA, no reordering: every build gives the same bits.
#pragma once
#include <cmath>
#include <cstddef>

namespace dfm {

struct Vec3 {
  double x = 0, y = 0, z = 0;
  // no pointer to x reaches y and z: clang takes that as a promise
  double &operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  double operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
};

inline bool all_finite(const double *x, size_t n) {
  double nan_flag = 0;
  for (size_t i = 0; i < n; ++i) nan_flag += 0.0 * x[i];
  return nan_flag == 0;
}
inline Vec3 load3(const double *p) { return {p[0], p[1], p[2]}; }
inline void store3(double *p, Vec3 a) {
  p[0] = a.x;
  p[1] = a.y;
  p[2] = a.z;
}
inline Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
inline Vec3 operator*(double s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
inline Vec3 &operator+=(Vec3 &a, Vec3 b) { return a = a + b; }
inline Vec3 &operator-=(Vec3 &a, Vec3 b) { return a = a - b; }
inline void add3(double *to, Vec3 a) { store3(to, load3(to) + a); }
inline double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm2(Vec3 a) { return dot(a, a); }
inline double norm(Vec3 a) { return std::sqrt(dot(a, a)); }
inline Vec3 normalized(Vec3 a) {
  const double n = norm(a);
  return n > 0 ? (1 / n) * a : Vec3{};
}
// Signed volume of a tetrahedron: positive where a, b, c run counter-clockwise seen from d's other side.
inline double tet_volume(Vec3 a, Vec3 b, Vec3 c, Vec3 d) { return dot(cross(b - a, c - a), d - a) / 6; }
// A unit vector orthogonal to the unit vector n; depends on n alone, so that equal normals give equal frames.
inline Vec3 any_tangent(Vec3 n) {
  const double ax = std::fabs(n.x), ay = std::fabs(n.y), az = std::fabs(n.z);
  const Vec3 e = ax <= ay && ax <= az ? Vec3{1, 0, 0} : ay <= az ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
  return normalized(cross(n, e));
}

// Unit quaternion x, y, z, w.
struct Quat { double x = 0, y = 0, z = 0, w = 1; };
inline Vec3 rotate(Quat q, Vec3 a) {
  const Vec3 u{q.x, q.y, q.z}, t = 2.0 * cross(u, a);
  return a + q.w * t + cross(u, t);
}
inline Vec3 rotate_back(Quat q, Vec3 a) { return rotate({-q.x, -q.y, -q.z, q.w}, a); }
inline Quat operator*(Quat a, Quat b) {
  return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
          a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}
// A quaternion of zeros is read as the identity (dfm_pose). Lengths whose square overflows or underflows are
// scaled first.
inline Quat unit_quat(const double q[4]) {
  const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (n > 1e-150 && n < 1e150) return {q[0] / n, q[1] / n, q[2] / n, q[3] / n};
  double most = 0;
  for (int k = 0; k < 4; ++k) most = std::fabs(q[k]) > most ? std::fabs(q[k]) : most;
  if (!(most > 0)) return {};
  const double near[4] = {q[0] / most, q[1] / most, q[2] / most, q[3] / most};
  return unit_quat(near);
}

}  // namespace dfm
