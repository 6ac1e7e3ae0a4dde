// Whether triangles pass through each other, and how far, by signs of rounded volumes: accurate enough where
// the last bit does not matter.
#pragma once
#include <algorithm>
#include <cmath>

#include "geometry/surface.h"
#include "math/vec3.h"

namespace dfm {

inline bool share_a_corner(const uint32_t *l, const uint32_t *r) {
  for (int i = 0; i < 9; ++i)
    if (l[i / 3] == r[i % 3]) return true;
  return false;
}

// m, the length of the edge p-q on the shorter side of a triangle x that it passes through; negative: it does
// not. vp, vq: volumes of x with p and with q; few triangles near each other have both signs.
inline double pierce(Vec3 p, Vec3 q, const Vec3 (&x)[3], double vp, double vq) {
  if (!(vp * vq < 0)) return -1;
  const double v0 = tet_volume(p, q, x[0], x[1]);
  const double v1 = tet_volume(p, q, x[1], x[2]);
  const double v2 = tet_volume(p, q, x[2], x[0]);
  if (!((v0 >= 0 && v1 >= 0 && v2 >= 0) || (v0 <= 0 && v1 <= 0 && v2 <= 0))) return -1;
  return 6 * std::min(std::fabs(vp), std::fabs(vq)) / norm(cross(x[1] - x[0], x[2] - x[0]));
}

// The largest of the edges of triangle p through triangle x.
inline double edges_pierce(const Vec3 (&p)[3], const Vec3 (&x)[3]) {
  double side[3], most = -1;
  for (int k = 0; k < 3; ++k) side[k] = tet_volume(x[0], x[1], x[2], p[k]);
  for (int k = 0, l = 1; k < 3; ++k, l = (l + 1) % 3)
    most = std::max(most, pierce(p[k], p[l], x, side[k], side[l]));
  return most;
}

inline bool triangles_cross(const Surface &a, uint32_t s, const Surface &b, uint32_t t) {
  const uint32_t *const i = &a.tri[3 * size_t{s}], *const j = &b.tri[3 * size_t{t}];
  const Vec3 p[3] = {load3(&a.x[4 * size_t{i[0]}]), load3(&a.x[4 * size_t{i[1]}]),
                     load3(&a.x[4 * size_t{i[2]}])};
  const Vec3 x[3] = {load3(&b.x[4 * size_t{j[0]}]), load3(&b.x[4 * size_t{j[1]}]),
                     load3(&b.x[4 * size_t{j[2]}])};
  return edges_pierce(p, x) >= 0 || edges_pierce(x, p) >= 0;
}

}  // namespace dfm
