// Cones of normals of edges and vertices: an edge or a vertex can be the first part of its surface to touch
// only along a direction in its cone of normals. Along any other direction a neighboring feature is nearer
// and gets the contact. Of a flat patch the edges' cones are empty and the vertices' have one direction; a
// patch that stays flat (a rigid mesh's) needs neither.
#pragma once
#include <algorithm>

#include "geometry/surface.h"
#include "math/vec3.h"

namespace dfm {

// Sine of the fold angle: such an edge is higher than the corners of its faces by at most kConvex / 4 of its
// length, 0.005 of the default d_c, so its contact begins and ends without a jump.
inline constexpr double kConvex = 2e-5;

// Sine of the fold at the positions x + ahead v, > 0 where the second face falls away from the first: -c0 .
// r1 |e| / (|c0| |c1|), with r1 to the second face's far corner and c the faces' normals times twice their
// areas. Not of an open edge.
struct Fold {
  double value, e2, size2;  // -c0 . r1, |e|^2, (|c0| |c1|)^2
  bool clear() const { return value * value * e2 > kConvex * kConvex * size2; }
};
inline Fold fold_of(const Surface &surface, uint32_t edge, double ahead) {
  const uint32_t *ends = &surface.edge[2 * size_t{edge}], *tris = &surface.edge_tri[2 * size_t{edge}];
  const auto x = [&](uint32_t s) {
    return load3(&surface.x[4 * size_t{s}]) + ahead * load3(&surface.v[4 * size_t{s}]);
  };
  const auto far_corner = [&](uint32_t t) {
    const uint32_t *c = &surface.tri[3 * size_t{t}];
    return c[0] + c[1] + c[2] - ends[0] - ends[1];
  };
  const Vec3 from = x(ends[0]), e = x(ends[1]) - from, r1 = x(far_corner(tris[1])) - from;
  const Vec3 c0 = cross(e, x(far_corner(tris[0])) - from), c1 = cross(r1, e);
  return {-dot(c0, r1), norm2(e), norm2(c0) * norm2(c1)};
}
inline bool edge_open(const Surface &surface, uint32_t edge) {
  return surface.edge_tri[2 * size_t{edge}] == kNone || surface.edge_tri[2 * size_t{edge} + 1] == kNone;
}

// An open edge counts as fully convex.
inline bool edge_convex(const Surface &surface, uint32_t edge, double ahead = 0) {
  if (edge_open(surface, edge)) return true;
  const Fold fold = fold_of(surface, edge, ahead);
  return fold.value > 0 && fold.clear();
}
inline bool edge_hollow(const Surface &surface, uint32_t edge, double ahead = 0) {
  if (edge_open(surface, edge)) return false;
  const Fold fold = fold_of(surface, edge, ahead);
  return fold.value < 0 && fold.clear();
}

// Is the unit direction d, which leaves the surface, in the cone of normals of this vertex? p + s e of an
// edge e comes nearer to what lies along d if e . d > 0. Where the surface is hollow no direction passes;
// there the vertex is what bears until the hollow is gone, and the cone is widened so that it holds the mean
// normal m of the faces around:
//     e . d <= max(0, e . m)  for every edge e at the vertex.
inline bool vertex_cone_has(const Surface &surface, uint32_t vertex, Vec3 d) {
  const Vec3 p = load3(&surface.x[4 * size_t{vertex}]);
  const uint32_t begin = surface.fan_begin[vertex], end = surface.fan_begin[vertex + 1];
  const auto sides = [&](uint32_t k, Vec3 out[2]) {  // the triangle is p, p + out[0], p + out[1]
    const uint32_t *c = &surface.tri[3 * size_t{surface.fan[k]}];
    const int at = c[0] == vertex ? 0 : c[1] == vertex ? 1 : 2;
    for (int i = 0; i < 2; ++i) out[i] = load3(&surface.x[4 * size_t{c[(at + 1 + i) % 3]}]) - p;
  };
  Vec3 e[2], mean;
  bool leans = false;
  for (uint32_t k = begin; k < end; ++k) {
    sides(k, e);
    mean += cross(e[0], e[1]);
    for (const Vec3 &side : e) leans |= dot(side, d) > kConvex * norm(side);
  }
  if (!leans) return true;
  mean = normalized(mean);
  for (uint32_t k = begin; k < end; ++k) {
    sides(k, e);
    for (const Vec3 &side : e)
      if (dot(side, d) > std::max(0.0, dot(side, mean)) + kConvex * norm(side)) return false;
  }
  return true;
}

}  // namespace dfm
