// Closest points of a triangle to a point and of two segments. Degenerate input gives finite answers: a
// triangle without area counts as its edges, an edge without length as a point.
#pragma once
#include <cstdint>

#include "math/vec3.h"

namespace dfm {

// Where on a triangle the closest point lies.
enum class TriangleFeature : uint8_t {
  face = 0,
  edge0 = 1,
  edge1 = 2,
  edge2 = 3,
  corner0 = 4,
  corner1 = 5,
  corner2 = 6
};

struct TrianglePoint {
  Vec3 point;
  double weight[3];
  double distance2;
  TriangleFeature feature;  // edge k joins corners k and k+1
};
TrianglePoint closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c);

// Parameter in [0,1] of the point of segment a-b that is closest to p.
inline double closest_on_segment(Vec3 p, Vec3 a, Vec3 b) {
  const Vec3 u = b - a;
  const double length2 = norm2(u), t = dot(p - a, u);
  return !(t > 0) ? 0 : t >= length2 ? 1 : t / length2;
}

struct SegmentPoints {
  double s, t;  // on p0-p1 and on q0-q1
  double distance2;
};
SegmentPoints closest_segments(Vec3 p0, Vec3 p1, Vec3 q0, Vec3 q1);

// Whether they are at most `limit` apart. Checks bounds first, because most pairs are far apart.
bool segments_within(Vec3 p0, Vec3 p1, Vec3 q0, Vec3 q1, double limit);
bool triangle_within(Vec3 p, Vec3 a, Vec3 b, Vec3 c, double limit);

}  // namespace dfm
