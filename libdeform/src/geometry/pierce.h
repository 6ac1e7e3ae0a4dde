// Whether triangles pass through each other, by signs of rounded volumes: accurate enough where the last bit
// does not matter.
#pragma once
#include "geometry/surface.h"
#include "math/vec3.h"

namespace dfm {

inline bool share_a_corner(const uint32_t *l, const uint32_t *r) {
  for (int i = 0; i < 9; ++i)
    if (l[i / 3] == r[i % 3]) return true;
  return false;
}

// Whether an edge of triangle s of `from` passes through triangle t of `to`. Then its ends are on both sides
// of the plane of t, which few triangles near each other have.
inline bool edges_pierce(const Surface &from, uint32_t s, const Surface &to, uint32_t t) {
  const uint32_t *const a = &from.tri[3 * size_t{s}], *const b = &to.tri[3 * size_t{t}];
  Vec3 p[3], x[3];
  double side[3];
  for (int k = 0; k < 3; ++k) x[k] = load3(&to.x[4 * size_t{b[k]}]);
  for (int k = 0; k < 3; ++k) {
    p[k] = load3(&from.x[4 * size_t{a[k]}]);
    side[k] = tet_volume(x[0], x[1], x[2], p[k]);
  }
  for (int k = 0, l = 1; k < 3; ++k, l = (l + 1) % 3) {
    if (!(side[k] * side[l] < 0)) continue;
    const double v0 = tet_volume(p[k], p[l], x[0], x[1]);
    const double v1 = tet_volume(p[k], p[l], x[1], x[2]);
    const double v2 = tet_volume(p[k], p[l], x[2], x[0]);
    if ((v0 >= 0 && v1 >= 0 && v2 >= 0) || (v0 <= 0 && v1 <= 0 && v2 <= 0)) return true;
  }
  return false;
}

inline bool triangles_cross(const Surface &a, uint32_t s, const Surface &b, uint32_t t) {
  return edges_pierce(a, s, b, t) || edges_pierce(b, t, a, s);
}

}  // namespace dfm
