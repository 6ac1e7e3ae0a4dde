#include "geometry/triangle_search.h"

#include <algorithm>
#include <utility>

namespace dfm {
namespace {

constexpr uint32_t kDepth = 64;       // of a tree of 2^32 triangles it is 30
constexpr double kRaySlack = 1e-8;    // of all lengths: how far a triangle's box is widened for rays
constexpr double kPointSlack = 1e-9;  // of all lengths: far above the rounding of a distance
constexpr double kParallel = 1e-300;  // components of a direction whose inverse would overflow

// Of a search from p: no coordinate of any difference is larger.
double length_scale(const BoxTree &tree, Vec3 p) {
  const Box &root = tree.root();
  double far = norm(p);
  for (int k = 0; k < 3; ++k) far = std::max({far, std::fabs(root.lo[k]), std::fabs(root.hi[k])});
  return far;
}

// bound(box): nothing in the box has a lower value. leaf(first, last) looks at triangles by their place and
// lowers `limit`.
template <class Bound, class Leaf>
void nearest_first(const BoxTree &tree, const double &limit, uint64_t &nodes, Bound &&bound, Leaf &&leaf) {
  struct Waiting {
    uint32_t node;
    double bound;
  } stack[kDepth];
  uint32_t n = 0;
  const auto wait = [&](const Waiting &w) {
    if (w.bound < kFar && w.bound <= limit) stack[n++] = w;
  };
  ++nodes;
  wait({0, bound(tree.boxes()[0])});
  while (n > 0) {
    const Waiting w = stack[--n];
    if (!(w.bound <= limit)) continue;
    const BoxTree::Node node = tree.nodes()[w.node];
    if (node.count) {
      leaf(node.right, node.right + node.count);
      continue;
    }
    Waiting near{w.node + 1, bound(tree.boxes()[w.node + 1])};
    Waiting far{node.right, bound(tree.boxes()[node.right])};
    nodes += 2;
    if (far.bound < near.bound) std::swap(near, far);
    wait(far);
    wait(near);
  }
}

// A ray and the boxes that it meets. Differences and products with the same factor keep their order when they
// are rounded, so a box in another one is never met before it.
class RayBoxes {
 public:
  RayBoxes(Vec3 o, Vec3 d, double slack) : o_(o), slack_(slack) {
    for (int k = 0; k < 3; ++k) inverse_[k] = std::fabs(d[k]) < kParallel ? 0 : 1 / d[k];
  }
  struct Span {
    double near;
    double far;
  };
  // Of the line in the widened box; near above far: it misses.
  Span meet(const Box &b) const {
    Span s{0, kFar};
    for (int k = 0; k < 3; ++k) {
      const double lo = b.lo[k] - slack_ - o_[k], hi = b.hi[k] + slack_ - o_[k];
      if (inverse_[k] == 0) {
        if (lo > 0 || hi < 0) return {kFar, 0};
        continue;
      }
      const double a = lo * inverse_[k], c = hi * inverse_[k];
      s.near = std::max(s.near, std::min(a, c));
      s.far = std::min(s.far, std::max(a, c));
    }
    return s;
  }
  double first(const Box &b) const {
    const Span s = meet(b);
    return s.near <= s.far ? s.near : kFar;
  }

 private:
  Vec3 o_;
  Vec3 inverse_;
  double slack_;
};

}  // namespace

double ray_triangle(Vec3 o, Vec3 d, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 e1 = b - a, e2 = c - a, p = cross(d, e2);
  const double det = dot(e1, p);
  if (det == 0) return kFar;
  const Vec3 s = o - a, q = cross(s, e1);
  const double u = dot(s, p) / det, v = dot(d, q) / det, t = dot(e2, q) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && t >= 0 ? t : kFar;
}

TriangleOnRay first_on_ray(const Triangles &m, Vec3 o, Vec3 unit, double limit, SearchCount *count) {
  TriangleOnRay best;
  if (m.tree.empty()) return best;
  const RayBoxes boxes(o, unit, kRaySlack * length_scale(m.tree, o));
  SearchCount own;
  double most = limit;
  const auto bound = [&](const Box &b) { return boxes.first(b); };
  const auto leaf = [&](uint32_t begin, uint32_t end) {
    for (uint32_t i = begin; i < end; ++i) {
      const RayBoxes::Span inside = boxes.meet(m.tree.triangle_boxes()[i]);
      if (!(inside.near <= inside.far && inside.near <= most)) continue;
      ++own.triangles;
      const uint32_t t = m.tree.triangles()[i];
      const double at = ray_triangle(o, unit, m.corner(t, 0), m.corner(t, 1), m.corner(t, 2));
      if (!(at >= inside.near && at <= inside.far && at < kFar)) continue;
      if (!(at < most || (at == most && t < best.triangle))) continue;
      most = at;
      best = {at, t};
    }
  };
  nearest_first(m.tree, most, own.nodes, bound, leaf);
  if (count) {
    count->nodes += own.nodes;
    count->triangles += own.triangles;
  }
  return best;
}

TriangleNearPoint closest_to(const Triangles &m, Vec3 p, DistanceKey key, double limit, SearchCount *count) {
  TriangleNearPoint best;
  if (m.tree.empty()) return best;
  const double slack = kPointSlack * length_scale(m.tree, p);
  const auto distance_of = [&](double value) { return key == DistanceKey::root ? value : std::sqrt(value); };
  SearchCount own;
  double most = limit;
  double reach = distance_of(limit) + slack;
  double reach2 = reach * reach;
  Vec3 away;  // from the best point to p, of length one; zero: none
  const Box point{{p.x, p.y, p.z, 0}, {p.x, p.y, p.z, 0}};
  const auto bound = [&](const Box &b) { return box_distance2(point, b); };
  // A triangle is at least as far from p as the plane across `away` through that of its corners which lies
  // farthest along it. Where triangles curve away from p this leaves out most of those whose boxes are near.
  const auto behind = [&](Vec3 a, Vec3 b, Vec3 c) {
    return dot(away, p) - std::max({dot(away, a), dot(away, b), dot(away, c)}) > reach;
  };
  const auto leaf = [&](uint32_t begin, uint32_t end) {
    for (uint32_t i = begin; i < end; ++i) {
      if (!(bound(m.tree.triangle_boxes()[i]) <= reach2)) continue;
      const uint32_t t = m.tree.triangles()[i];
      const Vec3 a = m.corner(t, 0), b = m.corner(t, 1), c = m.corner(t, 2);
      if (behind(a, b, c)) continue;
      ++own.triangles;
      const TrianglePoint q = closest_on_triangle(p, a, b, c);
      const double value = key == DistanceKey::root ? std::sqrt(q.distance2) : q.distance2;
      if (!(value < most || (value == most && t < best.triangle))) continue;
      most = value;
      reach = distance_of(value) + slack;
      reach2 = reach * reach;
      away = normalized(p - q.point);
      best = {value, t, q};
    }
  };
  nearest_first(m.tree, reach2, own.nodes, bound, leaf);
  if (count) {
    count->nodes += own.nodes;
    count->triangles += own.triangles;
  }
  return best;
}

}  // namespace dfm
