// Distance of two convex shapes, and the first contact of one that moves along a straight line with the
// other.
//
// A shape is a core, the hull of a few points, and a radius around it: a sphere is a point, a capsule a
// segment. The distance of two cores is found by the algorithm of Gilbert, Johnson and Keerthi (1988), with
// the closest points of simplices by Voronoi regions (geometry/closest.h).
#pragma once
#include <cstdint>

#include "math/vec3.h"

namespace dfm {

struct Convex {
  Vec3 position;
  Quat rotation;
  double radius = 0;               // m, around the core
  bool box = false;                // the core is a box of these half sizes
  Vec3 half;                       // m
  const double *points = nullptr;  // else the hull of these points, [npoint,3]; null: own
  uint32_t npoint = 1;
  double own[9] = {};
  bool turned = false;  // rotation is not the identity

  const double *core() const { return points ? points : own; }
  Vec3 support(Vec3 direction) const;  // a farthest point of the core
  double reach() const;                // m, farthest point of the shape from its position
  Vec3 any() const;                    // a point of the core
  // The same shape seen from a frame.
  Convex in_frame(Vec3 origin, Quat axes) const;
  void bounds(Vec3 &lo, Vec3 &hi) const;
};
Convex convex_triangle(Vec3 a, Vec3 b, Vec3 c);

struct ConvexGap {
  bool apart = false;   // the cores do not meet
  double distance = 0;  // m, of the cores
  double least = 0;     // m, proven lower bound: a plane across `normal` separates the cores by this distance
  Vec3 normal;          // unit, from b to a
  Vec3 on_a, on_b;
};
// a is displaced by `shift`.
ConvexGap convex_gap(const Convex &a, const Convex &b, Vec3 shift = {});

// The distance of two convex shapes is a convex function of the displacement of one of them, so Newton's
// method from the start never goes too far: each step goes as far as the separating plane allows
// (conservative advancement), until the distance is below 1e-10 of the largest length.
struct ConvexHit {
  bool hit = false;
  bool inside = false;  // touched at the start
  double way = 0;       // m
  Vec3 normal, point;   // from b to a; on b
};
// unit: the direction in which a moves, up to `limit`.
ConvexHit convex_cast(const Convex &a, const Convex &b, Vec3 unit, double limit);
// The same of shapes at rest that are up to `limit` apart: `way` is their distance. Inside: they overlap;
// touching counts, up to rounding.
ConvexHit convex_near(const Convex &a, const Convex &b, double limit);

}  // namespace dfm
