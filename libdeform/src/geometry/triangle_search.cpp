#include "geometry/triangle_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/tree_walk.h"

namespace dfm {
namespace {

constexpr double kPointSlack = 1e-9;  // of all lengths: far above the rounding of a distance

}  // namespace

ShearedRay::ShearedRay(Vec3 o, Vec3 d) : o_(o), z_(0) {
  for (int k = 1; k < 3; ++k)
    if (std::fabs(d[k]) > std::fabs(d[z_])) z_ = k;
  x_ = (z_ + 1) % 3;
  y_ = (z_ + 2) % 3;
  if (d[z_] < 0) std::swap(x_, y_);
  scale_ = 1 / d[z_];
  shear_x_ = d[x_] * scale_;
  shear_y_ = d[y_] * scale_;
}

ShearedRay::Products ShearedRay::of(Vec3 a, Vec3 b, Vec3 c) const {
  struct Corner { double x, y, z; };
  const auto sheared = [&](Vec3 p) -> Corner {
    const Vec3 r = p - o_;
    return {r[x_] - shear_x_ * r[z_], r[y_] - shear_y_ * r[z_], scale_ * r[z_]};
  };
  const Corner p = sheared(a), q = sheared(b), r = sheared(c);
  Products out{q.x * r.y - q.y * r.x, r.x * p.y - r.y * p.x, p.x * q.y - p.y * q.x, 0};
  out.along = out.a * p.z + out.b * q.z + out.c * r.z;
  return out;
}

double ray_triangle(const ShearedRay &ray, Vec3 a, Vec3 b, Vec3 c) {
  const ShearedRay::Products p = ray.of(a, b, c);
  const double t = p.along / p.sum();
  return p.meets() && p.sum() != 0 && t >= 0 ? t : kFar;
}

TriangleOnRay first_on_ray(const Triangles &m, Vec3 o, Vec3 unit, double limit, SearchCount *count) {
  TriangleOnRay best;
  if (m.tree.empty()) return best;
  const double slack = kRaySlack * length_scale(m.tree, o);
  const RayBoxes boxes(o, unit, {slack, slack, slack});
  const ShearedRay ray(o, unit);
  SearchCount own;
  double most = limit;
  const auto bound = [&](const Box &b) { return boxes.first(b); };
  const auto leaf = [&](uint32_t begin, uint32_t end) {
    for (uint32_t i = begin; i < end; ++i) {
      const RayBoxes::Span inside = boxes.meet(m.tree.triangle_boxes()[i]);
      if (!(inside.near <= inside.far && inside.near <= most)) continue;
      ++own.triangles;
      const uint32_t t = m.tree.triangles()[i];
      const double at = ray_triangle(ray, m.corner(t, 0), m.corner(t, 1), m.corner(t, 2));
      if (!(at >= inside.near && at <= inside.far && at < kFar)) continue;
      if (!(at < most || (at == most && t < best.triangle))) continue;
      most = at;
      best = {at, t};
    }
  };
  nearest_first(m.tree, most, own.nodes, bound, leaf);
  own.add_to(count);
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
  // farthest along it. If the triangles curve away from p, this skips most of those whose boxes are near.
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
  own.add_to(count);
  return best;
}

}  // namespace dfm
