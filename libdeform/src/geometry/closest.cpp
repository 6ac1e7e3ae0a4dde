// The Voronoi region of a triangle is found by signs of dot products, without division.
#include "geometry/closest.h"

#include <algorithm>

namespace dfm {
namespace {

// squared sine below which a cross product is too inaccurate to decide by
constexpr double kSolid = 1e-12;
// the rounding's square root: below this squared sine the places of two lines err by more than this share
constexpr double kParallel = 1.5e-8;

TrianglePoint on_corner(Vec3 p, Vec3 a, int corner) {
  TrianglePoint r{a, {0, 0, 0}, norm2(p - a), TriangleFeature(4 + corner)};
  r.weight[corner] = 1;
  return r;
}

// Edge `k` from a to b, t in (0,1).
TrianglePoint on_edge(Vec3 p, Vec3 a, Vec3 b, double t, int k) {
  const Vec3 q = a + t * (b - a);
  TrianglePoint r{q, {0, 0, 0}, norm2(p - q), TriangleFeature(1 + k)};
  r.weight[k] = 1 - t;
  r.weight[(k + 1) % 3] = t;
  return r;
}

TrianglePoint nearest_edge(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 x[3] = {a, b, c};
  TrianglePoint best = on_corner(p, a, 0);
  for (int k = 0; k < 3; ++k) {
    const Vec3 from = x[k], to = x[(k + 1) % 3];
    const double t = closest_on_segment(p, from, to);
    const TrianglePoint q = t <= 0   ? on_corner(p, from, k)
                            : t >= 1 ? on_corner(p, to, (k + 1) % 3)
                                     : on_edge(p, from, to, t, k);
    if (q.distance2 < best.distance2) best = q;
  }
  return best;
}

}  // namespace

TrianglePoint closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 ab = b - a, ac = c - a, bc = c - b, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return on_corner(p, a, 0);
  const double d3 = dot(ab, bp), d4 = dot(bc, bp);
  if (d3 >= 0 && d4 <= 0) return on_corner(p, b, 1);
  const double d5 = dot(bc, cp), d6 = dot(ac, cp);
  if (d5 >= 0 && d6 >= 0) return on_corner(p, c, 2);
  // Signed areas of the projection, from cross products with the normal: the differences of products that the
  // textbook form takes lose all digits on slivers.
  const Vec3 n = cross(ab, ac);
  const double nn = norm2(n);
  if (!(nn > 1e-28 * norm2(ab) * norm2(ac))) return nearest_edge(p, a, b, c);
  const double wa = dot(n, cross(bc, bp)), wb = -dot(n, cross(ac, cp)), wc = dot(n, cross(ab, ap));
  if (wa >= 0 && wb >= 0 && wc >= 0) {
    const double sum = wa + wb + wc, v = wb / sum, w = wc / sum;
    const Vec3 q = a + v * ab + w * ac;
    // never negative, as 1 - v - w might be
    return {q, {wa / sum, v, w}, norm2(p - q), TriangleFeature::face};
  }
  if (wc <= 0 && d1 >= 0 && d3 <= 0) return on_edge(p, a, b, d1 / (d1 - d3), 0);
  if (wa <= 0 && d4 >= 0 && d5 <= 0) return on_edge(p, b, c, d4 / (d4 - d5), 1);
  if (wb <= 0 && d2 >= 0 && d6 <= 0) return on_edge(p, c, a, d6 / (d6 - d2), 2);
  return nearest_edge(p, a, b, c);
}

SegmentPoints closest_segments(Vec3 p0, Vec3 p1, Vec3 q0, Vec3 q1) {
  const Vec3 u = p1 - p0, w = q1 - q0, r = p0 - q0;
  const double a = norm2(u), c = norm2(w), nn = norm2(cross(u, w));
  SegmentPoints best{0, 0, -1};
  const auto offer = [&](double s, double t) {
    const double d2 = norm2(r + s * u - t * w);
    if (best.distance2 < 0 || d2 < best.distance2) best = {s, t, d2};
  };
  if (nn > 1e-24 * a * c) {
    const double b = dot(u, w), d = dot(u, r), e = dot(w, r);
    const double s = (b * e - c * d) / nn, t = (a * e - b * d) / nn;
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1) offer(s, t);
    if (best.distance2 >= 0 && nn > kParallel * a * c) return best;
  }
  // The minimum lies on the border of the square of parameters, so at one of the four ends; of nearly
  // parallel segments one of these is as near.
  offer(0, closest_on_segment(p0, q0, q1));
  offer(1, closest_on_segment(p1, q0, q1));
  offer(closest_on_segment(q0, p0, p1), 0);
  offer(closest_on_segment(q1, p0, p1), 1);
  return best;
}

bool segments_within(Vec3 p0, Vec3 p1, Vec3 q0, Vec3 q1, double limit) {
  for (int k = 0; k < 3; ++k)
    if (std::max(p0[k], p1[k]) + limit < std::min(q0[k], q1[k]) ||
        std::max(q0[k], q1[k]) + limit < std::min(p0[k], p1[k]))
      return false;
  // The distance of lines is a lower bound for segments on them. NaN passes here and fails the last
  // comparison.
  const Vec3 u = p1 - p0, w = q1 - q0, n = cross(u, w);
  const double along = dot(n, p0 - q0), nn = norm2(n);
  if (nn > kSolid * norm2(u) * norm2(w) && along * along > limit * limit * (1 + 1e-9) * nn) return false;
  return closest_segments(p0, p1, q0, q1).distance2 <= limit * limit;
}

bool triangle_within(Vec3 p, Vec3 a, Vec3 b, Vec3 c, double limit) {
  for (int k = 0; k < 3; ++k)
    if (p[k] + limit < std::min({a[k], b[k], c[k]}) || p[k] - limit > std::max({a[k], b[k], c[k]}))
      return false;
  const Vec3 u = b - a, w = c - a, n = cross(u, w);
  const double along = dot(n, p - a), nn = norm2(n);
  if (nn > kSolid * norm2(u) * norm2(w) && along * along > limit * limit * (1 + 1e-9) * nn) return false;
  return closest_on_triangle(p, a, b, c).distance2 <= limit * limit;
}

}  // namespace dfm
