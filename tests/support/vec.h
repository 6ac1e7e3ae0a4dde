// Vectors of three.
#pragma once
#include <array>
#include <cmath>

namespace test {

using Vec = std::array<double, 3>;

inline Vec vec(const double *p) { return {p[0], p[1], p[2]}; }
inline Vec minus(const Vec &a, const Vec &b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline double dot(const Vec &a, const Vec &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline double norm(const Vec &a) { return std::sqrt(dot(a, a)); }
inline double apart(const Vec &a, const Vec &b) { return norm(minus(a, b)); }
inline Vec cross(const Vec &a, const Vec &b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

}  // namespace test
