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

inline bool pierces(Vec3 p, Vec3 q, const Surface &s, uint32_t triangle) {
  const uint32_t *const c = &s.tri[3 * size_t{triangle}];
  Vec3 x[3];
  for (int k = 0; k < 3; ++k) x[k] = load3(&s.x[4 * size_t{c[k]}]);
  if (!(tet_volume(x[0], x[1], x[2], p) * tet_volume(x[0], x[1], x[2], q) < 0)) return false;
  const double v0 = tet_volume(p, q, x[0], x[1]);
  const double v1 = tet_volume(p, q, x[1], x[2]);
  const double v2 = tet_volume(p, q, x[2], x[0]);
  return (v0 >= 0 && v1 >= 0 && v2 >= 0) || (v0 <= 0 && v1 <= 0 && v2 <= 0);
}

// Whether an edge of triangle s of `from` passes through triangle t of `to`.
inline bool edges_pierce(const Surface &from, uint32_t s, const Surface &to, uint32_t t) {
  const auto corner = [&](uint32_t k) { return load3(&from.x[4 * size_t{from.tri[3 * size_t{s} + k % 3]}]); };
  for (uint32_t k = 0; k < 3; ++k)
    if (pierces(corner(k), corner(k + 1), to, t)) return true;
  return false;
}

}  // namespace dfm
