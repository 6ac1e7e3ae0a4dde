// Distance of a flat patch to the origin. The nearest point is in the interior or on an edge beyond which the
// foot of the origin lies. Callers rely on the bounds only: any point of the patch bounds the distance from
// above, any unit vector n with min n . w[k] > 0 from below.
//
// Near contact the vector to the nearest point is mostly rounding error, so normals are computed from the
// features: across the patch, across an edge.
#include <algorithm>

#include "ccd/toi_query.h"

namespace dfm::toi {
namespace {

// If a smaller fraction of the distance is proven, other normals are tried too.
constexpr double kProven = 0.9;
// A cubic that is nowhere larger than that many times its error is computed again, sharper.
constexpr double kBlurred = 0x1p32;

struct Patch {
  Vec3 w[4];
  int n;
  Vec3 side(int k) const { return w[k + 1 < n ? k + 1 : 0] - w[k]; }
};

double least(const Patch &patch, Vec3 normal) {
  double low = dot(normal, patch.w[0]);
  for (int k = 1; k < patch.n; ++k) low = std::min(low, dot(normal, patch.w[k]));
  return low;
}

void offer_point(Separation &s, Vec3 point, double u, double v) {
  const double d = norm(point);
  if (d < s.upper) {
    s.upper = d;
    s.u = u;
    s.v = v;
  }
}

void offer_normal(Separation &s, const Patch &patch, Vec3 direction) {
  const double length = norm(direction);
  if (!(length > 0)) return;
  const Vec3 normal = (1 / length) * direction;
  const double lower = least(patch, normal);
  if (lower > s.lower) {
    s.lower = lower;
    s.normal = normal;
  }
}

// u and v of the point that lies at fraction s of side k.
void on_side(int n, int k, double s, double &u, double &v) {
  static const double corner_u[2][4] = {{0, 1, 0, 0}, {0, 1, 1, 0}};
  static const double corner_v[2][4] = {{0, 0, 1, 0}, {0, 0, 1, 1}};
  const int next = k + 1 < n ? k + 1 : 0;
  const double *cu = corner_u[n - 3], *cv = corner_v[n - 3];
  u = (1 - s) * cu[k] + s * cu[next];
  v = (1 - s) * cv[k] + s * cv[next];
}

void offer_side(Separation &s, const Patch &patch, int k) {
  const Vec3 from = patch.w[k], e = patch.side(k);
  const double ee = norm2(e), along = -dot(from, e);
  const int next = k + 1 < patch.n ? k + 1 : 0;
  const double fraction = !(along > 0) ? 0 : !(along < ee) ? 1 : along / ee;
  double u, v;
  on_side(patch.n, k, fraction, u, v);
  if (fraction == 0 || fraction == 1) {
    const Vec3 corner = fraction == 0 ? from : patch.w[next];
    offer_point(s, corner, u, v);
    offer_normal(s, patch, corner);
    return;
  }
  const Vec3 point = from + fraction * e;
  offer_point(s, point, u, v);
  offer_normal(s, patch, point - (dot(point, e) / ee) * e);
}

// Computes the foot of the origin from the best point so far instead of from a corner: the small area of a
// sliver then affects only the small remainder.
void offer_foot(Separation &s, const Patch &patch, Vec3 across) {
  const double area2 = norm2(across);
  if (!(area2 > 0)) return;
  const Vec3 r = patch.w[0], e1 = patch.w[1] - r, e2 = patch.w[patch.n - 1] - r;
  double u = s.u, v = s.v;
  for (int pass = 0; pass < 2; ++pass) {
    const Vec3 rest = r + u * e1 + v * e2;
    u = std::clamp(u + dot(cross(e2, rest), across) / area2, 0.0, 1.0);
    v = std::clamp(v + dot(cross(rest, e1), across) / area2, 0.0, patch.n == 3 ? 1 - u : 1.0);
    offer_point(s, r + u * e1 + v * e2, u, v);
  }
}

// The cross product of two long, nearly parallel sides leans by its rounding over its length, which matters
// along the patch alone.
Vec3 level(const Patch &patch, Vec3 across) {
  Vec3 longest;
  for (int k = 0; k < patch.n; ++k)
    if (norm2(patch.side(k)) > norm2(longest)) longest = patch.side(k);
  const double ee = norm2(longest);
  return ee > 0 ? across - (dot(across, longest) / ee) * longest : across;
}

// Tries all normals: for slivers, and for points near the border between the regions of two features.
void offer_all(Separation &s, const Patch &patch, Vec3 across) {
  const Vec3 normal = level(patch, across);
  offer_normal(s, patch, normal);
  offer_normal(s, patch, -normal);
  offer_foot(s, patch, across);
  for (int k = 0; k < patch.n; ++k) {
    offer_side(s, patch, k);
    offer_normal(s, patch, patch.w[k]);
    const Vec3 e = patch.side(k);
    const double ee = norm2(e);
    for (const Vec3 from : {patch.w[k], cross(across, e)})
      if (ee > 0) {
        const Vec3 beside = from - (dot(from, e) / ee) * e;
        offer_normal(s, patch, beside);
        offer_normal(s, patch, -beside);
      }
  }
}

}  // namespace

Separation separate(const Query &query, double t) {
  Patch patch;
  patch.n = query.ncorner;
  for (int k = 0; k < patch.n; ++k) patch.w[k] = query.corner(k, t);
  const Vec3 r = patch.w[0], e1 = patch.w[1] - r, e2 = patch.w[patch.n - 1] - r, across = cross(e1, e2);
  // The origin's foot is r + (a/area2) e1 + (b/area2) e2.
  const double area2 = norm2(across), a = dot(cross(e2, r), across), b = dot(cross(r, e1), across);
  Separation s;
  const bool triangle = patch.n == 3;
  const bool beyond[4] = {b < 0, triangle ? a + b > area2 : a > area2, triangle ? a < 0 : b > area2, a < 0};
  if (area2 > 0 && !beyond[0] && !beyond[1] && !beyond[2] && (triangle || !beyond[3])) {
    const double u = a / area2, v = b / area2;
    offer_point(s, r + u * e1 + v * e2, u, v);
    offer_normal(s, patch, dot(r, across) < 0 ? -across : across);
  } else {
    bool any = false;
    for (int k = 0; k < patch.n; ++k)
      if (beyond[k] || !(area2 > 0)) {
        offer_side(s, patch, k);
        any = true;
      }
    if (!any) offer_all(s, patch, across);
  }
  if (s.lower < kProven * s.upper - kRound) offer_all(s, patch, across);
  return s;
}

Coplanarity coplanarity(const Query &q) {
  const Vec3 n0 = cross(q.e1[0], q.e2[0]);
  const Vec3 n1 = cross(q.e1[0], q.e2[1]) + cross(q.e1[1], q.e2[0]);
  const Vec3 n2 = cross(q.e1[1], q.e2[1]);
  const Vec3 r0 = q.w0[0], r1 = q.w1[0];
  Coplanarity c;
  c.f = {3, {dot(r0, n0), dot(r1, n0) + dot(r0, n1), dot(r1, n1) + dot(r0, n2), dot(r1, n2)}};
  const auto size = [](Vec3 a, Vec3 b) {
    return std::max(
        {std::fabs(a.x), std::fabs(a.y), std::fabs(a.z), std::fabs(b.x), std::fabs(b.y), std::fabs(b.z)});
  };
  // Six products of three factors, each rounded at most eight times on the way and three times before: 66
  // units of 2^-53, and as much again for evaluating the polynomial.
  const double size3 = size(r0, r1) * size(q.e1[0], q.e1[1]) * size(q.e2[0], q.e2[1]);
  c.error = 0x1p-45 * size3;
  const double largest = c.f.size();
  c.vanishes = largest == 0;
  if (!c.vanishes && largest < kBlurred * c.error) {
    c.f = sharp_coplanarity(q).high;
    const double pairs = 0x1p-94 * size3, sharp = c.f.size();
    c.error = pairs + 0x1p-49 * sharp;
    c.vanishes = !(sharp > 16 * pairs);
  }
  c.normal_max = std::max({norm(n0), 0.5 * norm(n1), norm(n2)}) * (1 + kRound);
  return c;
}

bool apart_along_axis(const Query &q) {
  for (int axis = 0; axis < 3; ++axis) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int k = 0; k < q.ncorner; ++k) {
      low = std::min({low, q.w0[k][axis], q.w1[k][axis]});
      high = std::max({high, q.w0[k][axis], q.w1[k][axis]});
    }
    const double far = q.separation + kRound;
    if (low > far || high < -far) return true;
  }
  return false;
}

}  // namespace dfm::toi
