// Which edges stick out: only such an edge can meet another one before the surfels beside it do.
#pragma once
#include "math/vec3.h"
#include "surfel/surface.h"

namespace dfm {

// Sine of the fold: such an edge rises over its faces' corners by at most kConvex / 4 of its length, 0.005 of the default d_c, so that nothing
// is felt when it comes or goes.
inline constexpr double kConvex = 2e-5;

// At the positions x + ahead v. An open edge is as convex as can be. Between two faces the sine of the fold is c0 . r1 |e| / (|c0| |c1|), with r1
// to the second face's far corner and c the faces' normals times twice their areas; it is negative where the second face falls away from the first.
inline bool edge_convex(const Surface &surface, uint32_t edge, double ahead = 0) {
  const uint32_t *ends = &surface.edge[2 * size_t{edge}], *tris = &surface.edge_tri[2 * size_t{edge}];
  if (tris[0] == kNone || tris[1] == kNone) return true;
  const auto x = [&](uint32_t s) { return load3(&surface.x[4 * size_t{s}]) + ahead * load3(&surface.v[4 * size_t{s}]); };
  const auto far_corner = [&](uint32_t t) {
    const uint32_t *c = &surface.tri[3 * size_t{t}];
    return c[0] + c[1] + c[2] - ends[0] - ends[1];
  };
  const Vec3 from = x(ends[0]), e = x(ends[1]) - from, r0 = x(far_corner(tris[0])) - from, r1 = x(far_corner(tris[1])) - from;
  const Vec3 c0 = cross(e, r0), c1 = cross(r1, e);
  const double fold = dot(c0, r1);
  return fold < 0 && fold * fold * norm2(e) > kConvex * kConvex * norm2(c0) * norm2(c1);
}

}  // namespace dfm
