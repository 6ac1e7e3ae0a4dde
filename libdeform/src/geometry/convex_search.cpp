#include "geometry/convex_search.h"

namespace dfm {
namespace {

Box widened(const Triangles &m, const Convex &shape) {
  Vec3 lo, hi;
  shape.bounds(lo, hi);
  const double slack = kRaySlack * length_scale(m.tree, shape.position);
  Box out{};
  for (int k = 0; k < 3; ++k) {
    out.lo[k] = lo[k] - slack;
    out.hi[k] = hi[k] + slack;
  }
  return out;
}

}  // namespace

ShapeSearch::ShapeSearch(const Triangles &m, const Convex &shape, const ShapeWay &way)
    : m_(m),
      shape_(shape),
      way_(way),
      box_(widened(m, shape)),
      swept_(0.5 * (load3(box_.lo) + load3(box_.hi)), way.unit, 0.5 * (load3(box_.hi) - load3(box_.lo))) {}

ConvexHit ShapeSearch::meet(uint32_t t, double limit) const {
  return convex_meet(shape_, convex_triangle(m_.corner(t, 0), m_.corner(t, 1), m_.corner(t, 2)), way_, limit);
}

TriangleMet first_met(const Triangles &m, const Convex &shape, const ShapeWay &way, double limit) {
  TriangleMet best;
  if (m.tree.empty()) return best;
  const ShapeSearch search(m, shape, way);
  double most = limit, key = search.key(limit);
  uint64_t nodes = 0;
  const auto bound = [&](const Box &b) { return search.first(b); };
  const auto leaf = [&](uint32_t begin, uint32_t end) {
    for (uint32_t i = begin; i < end; ++i) {
      if (!(bound(m.tree.triangle_boxes()[i]) <= key)) continue;
      const uint32_t t = m.tree.triangles()[i];
      const ConvexHit hit = search.meet(t, most);
      if (!hit.hit || !(hit.way < most || (hit.way == most && t < best.triangle))) continue;
      best = {hit, t};
      most = hit.inside && !way.moves ? -1 : hit.way;  // -1: nothing is nearer
      key = search.key(most);
    }
  };
  nearest_first(m.tree, key, nodes, bound, leaf);
  return best;
}

int winding_by_ray(const Triangles &m, Vec3 p) {
  if (m.tree.empty()) return 0;
  // along no axis, no diagonal and no edge of common meshes; the next one where a ray meets an edge
  constexpr double directions[4][3] = {
      {0.48, 0.36, 0.8}, {-0.352, 0.896, 0.27}, {0.672, -0.504, 0.542}, {0.154, 0.528, -0.835}};
  int turns = 0;
  for (const auto &direction : directions) {
    const Vec3 d = load3(direction);
    const double slack = kRaySlack * length_scale(m.tree, p);
    const RayBoxes boxes(p, d, {slack, slack, slack});
    turns = 0;
    const ShearedRay ray(p, d);
    // Only a ray that meets an edge exactly is not clear.
    const bool clear = walk(
        m.tree,
        [&](const Box &b) {
          const RayBoxes::Span s = boxes.meet(b);
          return s.near <= s.far;
        },
        [&](uint32_t place) {
          const uint32_t t = m.tree.triangles()[place];
          const ShearedRay::Products at = ray.of(m.corner(t, 0), m.corner(t, 1), m.corner(t, 2));
          if (!at.meets()) return true;
          if (at.a == 0 || at.b == 0 || at.c == 0) return false;
          const bool outward = at.sum() > 0;
          if (outward ? at.along > 0 : at.along < 0) turns += outward ? 1 : -1;
          return true;
        });
    if (clear) break;
  }
  return turns;
}

}  // namespace dfm
