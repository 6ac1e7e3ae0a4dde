// Shared by all time-of-impact finders: the query in a common form, the distance of its features, the
// coplanarity cubic.
//
// Both kinds of query find the first time at which the origin is in a moving flat patch: corners w[k](t) are
// differences of a vertex of one feature and a vertex of the other, for a point and a triangle {p - a, p - b,
// p - c}, for two edges the parallelogram {a0-b0, a1-b0, a1-b1, a0-b1}. The features are as far apart as the
// patch is from the origin.
#pragma once
#include <cstdint>

#include "ccd/toi_poly.h"
#include "deform/toi.h"
#include "math/vec3.h"

namespace dfm::toi {

// Rounding of a scaled query, for |coordinate of a corner| <= 1: a corner at time t is off by less than 4
// units of 2^-53 per coordinate, its product with a unit vector by less than 16 in all, the mean of two such
// by less than 20.
constexpr double kRound = 0x1p-48;

struct Query {
  int ncorner = 3;  // 3 triangle, 4 parallelogram; in order around the patch
  // corners at t = 0 and 1, scaled by a power of two so that the largest coordinate is in [1/2, 1)
  Vec3 w0[4], w1[4];
  Vec3 e1[2], e2[2];  // w[1] - w[0] and w[last] - w[0] at t = 0 and 1, from the vertices themselves
  const dfm_motion *to[3], *from[3];  // w[0], e1 and e2 are to - from, scaled by powers of two
  // subtraction; each a product of two, which need not be a normal number where its factors are
  double before[2] = {1, 1}, after[2];
  double separation = 0;  // scaled like the corners
  double tolerance = 0;   // scaled distance (conservative), or width in t
  int max_iterations = 0;

  Vec3 corner(int k, double t) const { return (1 - t) * w0[k] + t * w1[k]; }
  // The patch at t: w0 + u e1 + v e2.
  Vec3 at(double t, double u, double v) const {
    const Vec3 r = corner(0, t);
    return r + u * (corner(1, t) - r) + v * (corner(ncorner - 1, t) - r);
  }
};

struct Root {
  double t = HUGE_VAL;
  double u = 0, v = 0;  // nearest point of the patch at t
  uint32_t evaluations = 0;
};

// Distance of the patch to the origin, between two bounds that are valid for any error in the computation of
// the nearest point.
struct Separation {
  // all of the patch lies beyond the plane normal . x = lower (below 0: no such plane was found)
  double lower = -1;
  double upper = HUGE_VAL;  // |nearest point found|
  double u = 0, v = 0;      // of that point
  Vec3 normal;              // unit length to rounding
};
Separation separate(const Query &query, double t);

// (w0 . (e1 x e2))(t): a zero is necessary for a touch.
struct Coplanarity {
  Poly f;
  double error;       // bound of the rounding of coefficients and values
  double normal_max;  // bound of |e1 x e2| over [0,1]
  bool vanishes;      // f is zero within its error
};
Coplanarity coplanarity(const Query &query);
// The same in pairs of doubles, ten times slower.
struct SharpCubic {
  Poly high, low;  // high: each coefficient rounded once
  double operator()(double t) const;
};
SharpCubic sharp_coplanarity(const Query &query);
// Nothing can touch: all corners lie on one side along an axis over the whole step.
bool apart_along_axis(const Query &query);

Root conservative(const Query &query);
Root by_roots(const Query &query, int method);

}  // namespace dfm::toi
