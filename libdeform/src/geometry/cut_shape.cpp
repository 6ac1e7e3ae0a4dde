// In coordinates scaled by its semi-axes an ellipsoid is a unit ball; there the test is the distance of the
// tetrahedron from the segment along which the center moves. A box swept along a straight line and a blade
// are convex, like the tetrahedron: two convex bodies are disjoint if a face normal of one, or the cross
// product of an edge of each, separates them.
#include "geometry/cut_shape.h"

#include <algorithm>

#include "geometry/closest.h"

namespace dfm {
namespace {

constexpr int kEdge[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
constexpr int kFace[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

bool inside(Vec3 p, const Vec3 x[4]) {
  const double whole = tet_volume(x[0], x[1], x[2], x[3]);
  const double part[4] = {tet_volume(p, x[1], x[2], x[3]), tet_volume(x[0], p, x[2], x[3]),
                          tet_volume(x[0], x[1], p, x[3]), tet_volume(x[0], x[1], x[2], p)};
  return whole != 0 && std::all_of(part, part + 4, [&](double v) { return v * whole >= 0; });
}

// Whether the segment passes through the triangle. An end on its plane counts as on the side of its normal.
bool crosses(Vec3 p, Vec3 q, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 n = cross(b - a, c - a);
  if ((dot(n, p - a) >= 0) == (dot(n, q - a) >= 0)) return false;
  const double u = tet_volume(p, q, a, b), v = tet_volume(p, q, b, c), w = tet_volume(p, q, c, a);
  return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

bool near_segment(Vec3 p, Vec3 q, const Vec3 x[4], double distance) {
  if (inside(p, x) || inside(q, x)) return true;
  for (const auto &f : kFace)
    if (crosses(p, q, x[f[0]], x[f[1]], x[f[2]]) || triangle_within(p, x[f[0]], x[f[1]], x[f[2]], distance) ||
        triangle_within(q, x[f[0]], x[f[1]], x[f[2]], distance))
      return true;
  return std::any_of(kEdge, kEdge + 6,
                     [&](const int (&e)[2]) { return segments_within(p, q, x[e[0]], x[e[1]], distance); });
}

bool ellipsoid_meets(const CutShape &s, const Vec3 corner[4]) {
  const auto scaled = [&](Vec3 v) {
    const Vec3 own = rotate_back(s.rotation, v);
    return Vec3{own.x / s.half_size.x, own.y / s.half_size.y, own.z / s.half_size.z};
  };
  Vec3 x[4];
  for (int k = 0; k < 4; ++k) x[k] = scaled(corner[k] - s.position);
  return near_segment({}, scaled(s.way), x, 1);
}

// The extent of a convex body along an axis.
struct Span { double low, high; };

Span span_of(const Vec3 *x, int n, Vec3 axis) {
  Span s{dot(axis, x[0]), dot(axis, x[0])};
  for (int k = 1; k < n; ++k) {
    s.low = std::min(s.low, dot(axis, x[k]));
    s.high = std::max(s.high, dot(axis, x[k]));
  }
  return s;
}

bool apart(Span a, Span b) { return a.high < b.low || b.high < a.low; }

// All points `center` plus shares of -1 to 1 of the directions.
Span span_of(Vec3 center, const Vec3 *direction, int n, Vec3 axis) {
  double half = 0;
  for (int k = 0; k < n; ++k) half += std::fabs(dot(axis, direction[k]));
  return {dot(axis, center) - half, dot(axis, center) + half};
}

bool box_meets(const CutShape &s, const Vec3 x[4]) {
  Vec3 along[4];
  for (int k = 0; k < 3; ++k) {
    Vec3 axis;
    axis[k] = s.half_size[k];
    along[k] = rotate(s.rotation, axis);
  }
  along[3] = 0.5 * s.way;
  const Vec3 center = s.position + along[3];
  const auto parts = [&](Vec3 axis) { return apart(span_of(center, along, 4, axis), span_of(x, 4, axis)); };
  for (const auto &f : kFace)
    if (parts(cross(x[f[1]] - x[f[0]], x[f[2]] - x[f[0]]))) return false;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < i; ++j)
      if (parts(cross(along[i], along[j]))) return false;
    for (const auto &e : kEdge)
      if (parts(cross(along[i], x[e[1]] - x[e[0]]))) return false;
  }
  return true;
}

bool triangle_meets(const Vec3 t[3], const Vec3 x[4]) {
  const auto parts = [&](Vec3 axis) { return apart(span_of(t, 3, axis), span_of(x, 4, axis)); };
  const Vec3 side[3] = {t[1] - t[0], t[2] - t[1], t[0] - t[2]}, normal = cross(side[0], side[1]);
  if (parts(normal)) return false;
  for (const auto &f : kFace)
    if (parts(cross(x[f[1]] - x[f[0]], x[f[2]] - x[f[0]]))) return false;
  for (const Vec3 s : side) {
    if (parts(cross(normal, s))) return false;  // where both lie in one plane
    for (const auto &e : kEdge)
      if (parts(cross(s, x[e[1]] - x[e[0]]))) return false;
  }
  return true;
}

}  // namespace

bool meets_tetrahedron(const CutShape &s, const Vec3 corner[4]) {
  if (s.kind == CutKind::ellipsoid) return ellipsoid_meets(s, corner);
  if (s.kind == CutKind::box) return box_meets(s, corner);
  const Vec3 first[3] = {s.corner[0], s.corner[1], s.corner[2]},
             second[3] = {s.corner[0], s.corner[2], s.corner[3]};
  return triangle_meets(first, corner) || triangle_meets(second, corner);
}

bool crosses_blade(const CutShape &s, Vec3 a, Vec3 b) {
  return crosses(a, b, s.corner[0], s.corner[1], s.corner[2]) ||
         crosses(a, b, s.corner[0], s.corner[2], s.corner[3]);
}

}  // namespace dfm
