// Contact between two bodies that a cut has made of one.
//
//   a ______p      The faces of the cut are set back on both sides (geometry/surface.h), so that the copies
//           :      p and q of a point are apart by the difference of their ways back. Along the normal of
//     ______q      each face around them it is d_c or more if these normals lie in one half-space; in the
//   b              teeth of a rough cut it may be anything, also less than zero.
//
// A pair of features with copies of one point among its corners rests at min(b, d_c), where b is that
// difference along the normal of the contact. The line or plane of each feature goes through its copy, so the
// pair is at b exactly while the copies are in one place: nothing has to open after a cut, and no motion
// opens more than it has to. Copies that have moved apart by more than setting back moves them no longer say
// on which side of an edge a feature is; from kNearCopies on the distance goes over to d_c, that of two
// bodies (doc/decisions/cutting.md).
#pragma once
#include <algorithm>
#include <span>

#include "body/self_rest.h"
#include "contact/contact_set.h"
#include "geometry/surface.h"

namespace dfm {

// ids: of the two bodies.
inline bool parts_of_one(const Surface &a, uint64_t id_a, const Surface &b, uint64_t id_b) {
  return !a.origin.empty() && !b.origin.empty() && a.whole(id_a) == b.whole(id_b);
}

// m, where two features of such bodies rest whose contact has this normal (unit length, from b to a).
inline double rest_of_parts(const Surface &a, std::span<const uint32_t> corners_a, const Surface &b,
                            std::span<const uint32_t> corners_b, Vec3 normal, double offset) {
  double rest = offset;
  for (const uint32_t i : corners_a)
    for (const uint32_t j : corners_b) {
      if (a.origin[i] != b.origin[j]) continue;
      const Vec3 p = load3(&a.place[4 * size_t{i}]), q = load3(&b.place[4 * size_t{j}]);
      const double held = std::clamp(2 - norm(p - q) / (kNearCopies * offset), 0.0, 1.0);
      const double back = dot(normal, load3(&a.x[4 * size_t{i}]) - p - load3(&b.x[4 * size_t{j}]) + q);
      rest = std::min(rest, offset - held * (offset - std::min(back, offset)));
    }
  return rest;
}

// kEdgeEdge: two edges; else a surfel and a triangle.
inline double rest_of_parts(const Surface &a, const Surface &b, uint8_t kind, uint32_t feature_a,
                            uint32_t feature_b, Vec3 normal, double offset) {
  if (kind == kEdgeEdge)
    return rest_of_parts(a, {&a.edge[2 * size_t{feature_a}], 2}, b, {&b.edge[2 * size_t{feature_b}], 2},
                         normal, offset);
  return rest_of_parts(a, {&feature_a, 1}, b, {&b.tri[3 * size_t{feature_b}], 3}, normal, offset);
}

}  // namespace dfm
