// A convex shape against a surface of triangles, through the tree of the surface. A box is skipped only if no
// triangle in it can change the result, so results are those of a test of every triangle; of equal triangles
// the lowest number.
#pragma once
#include <cmath>

#include "geometry/convex_gap.h"
#include "geometry/tree_walk.h"
#include "geometry/triangle_search.h"

namespace dfm {

// How a shape meets others: on its way along `unit`, or by distance where it is.
struct ShapeWay {
  bool moves = false;
  Vec3 unit;
};
inline ConvexHit convex_meet(const Convex &a, const Convex &b, const ShapeWay &way, double limit) {
  return way.moves ? convex_cast(a, b, way.unit, limit) : convex_near(a, b, limit);
}

// A shape and the triangles of a tree.
class ShapeSearch {
 public:
  // The tree may not be empty.
  ShapeSearch(const Triangles &triangles, const Convex &shape, const ShapeWay &way);
  // At or below the key of the way to anything in the box.
  double first(const Box &b) const { return way_.moves ? swept_.first(b) : box_distance2(box_, b); }
  // The way itself, of a shape at rest its square: no box needs a square root.
  double key(double way) const { return way_.moves || way < 0 ? way : way * way; }
  ConvexHit meet(uint32_t triangle, double limit) const;

 private:
  const Triangles &m_;
  const Convex &shape_;
  const ShapeWay way_;
  const Box box_;  // wider than the shape by more than rounding
  const RayBoxes swept_;
};

struct TriangleMet {
  ConvexHit hit;
  uint32_t triangle = kNone;
};
// The first triangle that the shape meets, up to and including `limit`; of a shape at rest that overlaps the
// surface, any.
TriangleMet first_met(const Triangles &triangles, const Convex &shape, const ShapeWay &way, double limit);

// Calls f(hit, triangle) for all that it meets, in no order. f may lower `limit`; -1 ends it.
template <class F>
void each_met(const Triangles &m, const Convex &shape, const ShapeWay &way, const double &limit, F &&f) {
  if (m.tree.empty()) return;
  const ShapeSearch search(m, shape, way);
  near_triangles(
      m.tree, [&](const Box &b) { return search.first(b) <= search.key(limit); },
      [&](uint32_t t) {
        if (const ConvexHit hit = search.meet(t, limit); hit.hit) f(hit, t);
      });
}

// How often a closed surface winds around p: 1 inside, where its triangles look outward. By a ray, so exact
// to rounding; p on the surface may count either way.
int winding_by_ray(const Triangles &triangles, Vec3 p);

// Calls f(distance, triangle) for all triangles on a ray up to and including `limit`, in no order. As
// first_on_ray. f may lower `limit`; -1 ends it.
template <class F>
void all_on_ray(const Triangles &m, Vec3 o, Vec3 unit, const double &limit, F &&f) {
  if (m.tree.empty()) return;
  const double slack = kRaySlack * length_scale(m.tree, o);
  const RayBoxes boxes(o, unit, {slack, slack, slack});
  const ShearedRay ray(o, unit);
  walk(
      m.tree,
      [&](const Box &b) {
        const RayBoxes::Span s = boxes.meet(b);
        return s.near <= s.far && s.near <= limit;
      },
      [&](uint32_t place) {
        const RayBoxes::Span inside = boxes.meet(m.tree.triangle_boxes()[place]);
        const uint32_t t = m.tree.triangles()[place];
        const double at = ray_triangle(ray, m.corner(t, 0), m.corner(t, 1), m.corner(t, 2));
        if (at >= inside.near && at <= inside.far && at <= limit && at < kFar) f(at, t);
        return true;
      });
}

}  // namespace dfm
