// Distances and casts of convex shapes against closed formulas, and through a tree against every triangle.
#include "geometry/convex_gap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "geometry/closest.h"
#include "geometry/convex_search.h"

namespace {

using dfm::Convex;
using dfm::Vec3;

class Random {
 public:
  double number(double lo, double hi) { return lo + (hi - lo) * (double(engine_()) / 4294967296.0); }
  Vec3 in_box(double size) { return {number(-size, size), number(-size, size), number(-size, size)}; }
  dfm::Quat turn() {
    const double q[4] = {number(-1, 1), number(-1, 1), number(-1, 1), number(-1, 1)};
    return dfm::unit_quat(q);
  }

 private:
  std::mt19937 engine_{7};
};

Convex ball(Vec3 at, double r) {
  Convex c;
  c.position = at;
  c.radius = r;
  return c;
}
Convex capsule(Vec3 at, dfm::Quat q, double half, double r) {
  Convex c = ball(at, r);
  c.rotation = q;
  c.turned = true;
  c.npoint = 2;
  c.own[2] = -half;
  c.own[5] = half;
  return c;
}
Convex box(Vec3 at, dfm::Quat q, Vec3 half) {
  Convex c = ball(at, 0);
  c.rotation = q;
  c.turned = true;
  c.box = true;
  c.half = half;
  return c;
}

double to_box(Vec3 p, const Convex &b) {
  const Vec3 local = dfm::rotate_back(b.rotation, p - b.position);
  Vec3 out;
  for (int k = 0; k < 3; ++k) out[k] = std::max(0.0, std::fabs(local[k]) - b.half[k]);
  return dfm::norm(out);
}

// Triangles with their tree.
struct Soup {
  std::vector<uint32_t> corners;
  std::vector<double> x;
  dfm::BoxTree tree{dfm::Memory::standard()};
  void add(Vec3 a, Vec3 b, Vec3 c) {
    for (const Vec3 p : {a, b, c}) {
      corners.push_back(uint32_t(x.size() / 4));
      x.insert(x.end(), {p.x, p.y, p.z, 0});
    }
  }
  dfm::Triangles renew() {
    tree.renew(corners, x.data());
    return {tree, corners, x.data()};
  }
};

}  // namespace

TEST(ConvexGap, PointAndTriangle_MatchTheClosestPoint) {
  Random r;
  for (int i = 0; i < 20000; ++i) {
    const double scale = std::pow(10, r.number(-4, 2));
    const Vec3 a = scale * r.in_box(1), b = scale * r.in_box(1), c = scale * r.in_box(1);
    const Vec3 p = scale * r.in_box(3);
    const double want = std::sqrt(dfm::closest_on_triangle(p, a, b, c).distance2);
    const dfm::ConvexGap gap = dfm::convex_gap(ball(p, 0), dfm::convex_triangle(a, b, c));
    ASSERT_TRUE(gap.apart) << i;
    ASSERT_NEAR(gap.distance, want, 1e-12 * scale) << i;
    ASSERT_LE(gap.least, gap.distance * (1 + 1e-12));
    ASSERT_NEAR(gap.least, want, 1e-11 * scale) << "the plane that is proven, " << i;
  }
}

TEST(ConvexGap, SegmentsAndBoxes_MatchClosedForms) {
  Random r;
  for (int i = 0; i < 5000; ++i) {
    const Convex a = capsule(r.in_box(1), r.turn(), r.number(0, 1), 0);
    const Convex b = capsule(r.in_box(1), r.turn(), r.number(0, 1), 0);
    const auto ends = [](const Convex &c, double s) {
      return c.position + dfm::rotate(c.rotation, {0, 0, s * c.own[5]});
    };
    const double want =
        std::sqrt(dfm::closest_segments(ends(a, -1), ends(a, 1), ends(b, -1), ends(b, 1)).distance2);
    ASSERT_NEAR(dfm::convex_gap(a, b).distance, want, 1e-11) << i;
    const Convex c = box(r.in_box(1), r.turn(), {r.number(0, 1), r.number(0, 1), r.number(0, 1)});
    const Vec3 p = r.in_box(2);
    const dfm::ConvexGap gap = dfm::convex_gap(ball(p, 0), c);
    const double from = to_box(p, c);
    ASSERT_EQ(gap.apart, from > 1e-13) << i;
    if (gap.apart) {
      ASSERT_NEAR(gap.distance, from, 1e-12) << i;
      ASSERT_NEAR(to_box(gap.on_b, c), 0, 1e-12) << i;
      ASSERT_NEAR(dfm::norm(gap.on_a - gap.on_b), from, 1e-11) << i;
    }
  }
}

// Segments beside each other, of length one, a little askew: as near as their closest ends, or nearer.
TEST(ClosestSegments, NearlyParallel_AreNoFartherThanTheirEnds) {
  Random r;
  for (int i = 0; i < 20000; ++i) {
    const double askew = std::pow(10, r.number(-12, -3));
    const Vec3 p0 = r.in_box(1), along = dfm::rotate(r.turn(), {1, 0, 0});
    const Vec3 q0 = p0 + r.number(-0.9, 0.9) * along + 1e-3 * dfm::any_tangent(along);
    const Vec3 p1 = p0 + along, q1 = q0 + along + askew * r.in_box(1);
    const double d = std::sqrt(dfm::closest_segments(p0, p1, q0, q1).distance2);
    const auto to = [](Vec3 p, Vec3 a, Vec3 b) {
      return dfm::norm(p - a - dfm::closest_on_segment(p, a, b) * (b - a));
    };
    const double ends = std::min({to(p0, q0, q1), to(p1, q0, q1), to(q0, p0, p1), to(q1, p0, p1)});
    ASSERT_LE(d, ends * (1 + 1e-12)) << i << ", " << askew;
  }
}

TEST(ConvexGap, ShapesWithoutSize_GiveFiniteResults) {
  const Vec3 p{1, 2, 3};
  EXPECT_FALSE(dfm::convex_gap(ball(p, 0), ball(p, 0)).apart);
  EXPECT_NEAR(dfm::convex_gap(ball(p, 0), dfm::convex_triangle({}, {}, {})).distance, dfm::norm(p), 1e-15);
  EXPECT_NEAR(
      dfm::convex_gap(box({0, 0, 3}, {}, {1, 1, 0}), dfm::convex_triangle({}, {1, 0, 0}, {2, 0, 0})).distance,
      3, 1e-15);
  const double same[12] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
  Convex hull;
  hull.points = same;
  hull.npoint = 4;
  EXPECT_NEAR(dfm::convex_gap(hull, ball({1, 1, 3}, 0)).distance, 2, 1e-15);
}

TEST(ConvexCast, Balls_MeetWhereTheFormulaSays) {
  Random r;
  int hits = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 from = r.in_box(3), d = dfm::normalized(r.in_box(1));
    const double ra = r.number(0, 0.5), rb = r.number(0.01, 1);
    const double b = dfm::dot(from, d), c = dfm::norm2(from) - (ra + rb) * (ra + rb), disc = b * b - c;
    const dfm::ConvexHit hit = dfm::convex_cast(ball(from, ra), ball({}, rb), d, 100);
    if (c <= 0) {
      EXPECT_TRUE(hit.hit && hit.inside && hit.way == 0);
    } else if (disc > 1e-9 && b < 0) {
      ASSERT_TRUE(hit.hit) << i;
      ++hits;
      // grazing by a speed v along the normal turns the tolerance of the distance into tolerance / v
      ASSERT_NEAR(hit.way, -b - std::sqrt(disc), 1e-9 / std::sqrt(disc) + 1e-12) << i;
      ASSERT_NEAR(dfm::norm(hit.point), rb, 1e-8) << i;
    } else if (disc < -1e-8 || b > 0) {
      ASSERT_FALSE(hit.hit) << i;
    }
  }
  EXPECT_GT(hits, 500);
}

TEST(ConvexCast, CornerEdgeAndFaceOfABox_MeetATriangle) {
  const Convex floor = dfm::convex_triangle({-10, -10, 0}, {10, -10, 0}, {0, 10, 0});
  const Convex flat = box({0, 0, 5}, {}, {1, 2, 0.5});
  dfm::ConvexHit hit = dfm::convex_cast(flat, floor, {0, 0, -1}, 10);
  ASSERT_TRUE(hit.hit);
  EXPECT_NEAR(hit.way, 4.5, 1e-9);
  EXPECT_NEAR(hit.normal.z, 1, 1e-9);
  const double s = std::sin(M_PI / 8), c = std::cos(M_PI / 8);
  const Convex edge = box({0, 0, 5}, {s, 0, 0, c}, {1, 1, 1});
  hit = dfm::convex_cast(edge, floor, {0, 0, -1}, 10);
  EXPECT_NEAR(hit.way, 5 - std::sqrt(2), 1e-9);
  EXPECT_FALSE(dfm::convex_cast(edge, floor, {0, 0, -1}, 3).hit) << "beyond the limit";
  EXPECT_FALSE(dfm::convex_cast(edge, floor, {0, 0, 1}, 100).hit) << "away";
  EXPECT_FALSE(dfm::convex_cast(edge, floor, {1, 0, 0}, 100).hit) << "along";
}

TEST(ConvexCast, NeverPassesThrough_AndEndsWhereItTouches) {
  Random r;
  int hits = 0;
  for (int i = 0; i < 5000; ++i) {
    double points[24];
    for (double &x : points) x = r.number(-0.3, 0.3);
    Convex shape = ball(r.in_box(2), i % 2 ? r.number(0, 0.2) : 0);
    shape.points = points;
    shape.npoint = 8;
    shape.rotation = r.turn();
    shape.turned = true;
    const Convex triangle = dfm::convex_triangle(r.in_box(1), r.in_box(1), r.in_box(1));
    const Vec3 d = dfm::normalized(r.in_box(1));
    const dfm::ConvexHit hit = dfm::convex_cast(shape, triangle, d, 5);
    const auto space = [&](double way) {
      const dfm::ConvexGap gap = dfm::convex_gap(shape, triangle, way * d);
      return (gap.apart ? gap.distance : 0) - shape.radius;
    };
    const double end = hit.hit ? hit.way : 5;
    for (int k = 0; k < 20 && !hit.inside; ++k) ASSERT_GT(space(0.999 * end * k / 20), 0) << i << ", " << k;
    if (!hit.hit) continue;
    ++hits;
    ASSERT_LE(space(hit.way), 1e-9 * 8) << i;
  }
  EXPECT_GT(hits, 300);
}

TEST(ConvexSearch, ThroughATree_GivesTheBitsOfEveryTriangle) {
  Random r;
  for (int round = 0; round < 20; ++round) {
    Soup soup;
    for (int t = 0; t < 300; ++t) {
      const Vec3 at = r.in_box(1);
      soup.add(at + r.in_box(0.1), at + r.in_box(0.1), at + r.in_box(0.1));
      if (t % 7 == 0) soup.add(at, at, at + r.in_box(0.1));
    }
    const dfm::Triangles m = soup.renew();
    const uint32_t n = uint32_t(soup.corners.size() / 3);
    const auto triangle = [&](uint32_t t) {
      return dfm::convex_triangle(m.corner(t, 0), m.corner(t, 1), m.corner(t, 2));
    };
    for (int i = 0; i < 20; ++i) {
      const Convex shape = i % 3 == 0   ? ball(r.in_box(2), r.number(0, 0.2))
                           : i % 3 == 1 ? box(r.in_box(2), r.turn(), {0.1, 0.2, 0.05})
                                        : capsule(r.in_box(2), r.turn(), 0.2, 0.05);
      const Vec3 d = dfm::normalized(r.in_box(1));
      dfm::TriangleMet want, least;
      double most = 3;
      std::vector<uint32_t> touched;
      for (uint32_t t = 0; t < n; ++t) {
        const dfm::ConvexHit hit = dfm::convex_cast(shape, triangle(t), d, 3);
        if (hit.hit && (hit.way < most || want.triangle == dfm::kNone)) {
          most = hit.way;
          want = {hit, t};
        }
        const dfm::ConvexHit near = dfm::convex_near(shape, triangle(t), 0.7);
        if (near.hit && (!least.hit.hit || near.way < least.hit.way)) least = {near, t};
        if (near.hit && near.inside) touched.push_back(t);
      }
      const dfm::TriangleMet got = dfm::first_met(m, shape, {true, d}, 3);
      ASSERT_EQ(got.triangle, want.triangle) << round << ", " << i;
      if (want.triangle != dfm::kNone) {
        ASSERT_EQ(got.hit.way, want.hit.way);
        ASSERT_EQ(got.hit.point.x, want.hit.point.x);
        ASSERT_EQ(got.hit.normal.z, want.hit.normal.z);
      }
      std::vector<uint32_t> list;
      dfm::each_met(m, shape, {}, 0, [&](const dfm::ConvexHit &, uint32_t t) { list.push_back(t); });
      std::sort(list.begin(), list.end());
      ASSERT_EQ(list, touched);
      ASSERT_EQ(dfm::first_met(m, shape, {}, 0).hit.hit, !touched.empty());
      const dfm::TriangleMet near = dfm::first_met(m, shape, {}, 0.7);
      ASSERT_EQ(near.hit.hit, least.hit.hit) << round << ", " << i;
      if (least.hit.hit) {
        ASSERT_EQ(near.hit.way, least.hit.way);
      }
      if (least.hit.hit && !least.hit.inside) {
        ASSERT_EQ(near.triangle, least.triangle);
      }
    }
  }
}

// A cube of twelve triangles, looking outward.
constexpr Vec3 kCube[8] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                           {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
constexpr int kCubeFaces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};

TEST(TriangleSearch, RaysAtCornersAndEdges_NeverSlipThrough) {
  Random r;
  for (int i = 0; i < 300; ++i) {
    const dfm::Quat q = r.turn();
    const Vec3 shift = r.in_box(1);
    Vec3 x[8];
    for (int k = 0; k < 8; ++k) x[k] = dfm::rotate(q, kCube[k]) + shift;
    Soup soup;
    for (const auto &f : kCubeFaces) soup.add(x[f[0]], x[f[1]], x[f[2]]);
    const dfm::Triangles m = soup.renew();
    const Vec3 middle = 0.5 * (x[0] + x[7]), o = middle + dfm::rotate(r.turn(), {4, 0, 0});
    const auto met = [&](Vec3 p) {
      const double way = dfm::norm(p - o);
      EXPECT_LE(dfm::first_on_ray(m, o, (1 / way) * (p - o), 10).distance, way * (1 + 1e-9)) << i;
    };
    for (const Vec3 p : x) met(0.999999 * (p - middle) + middle);
    // exactly on what triangles share, up to the rounding of the point
    for (const auto &f : kCubeFaces)
      for (int k = 0; k < 3; ++k) {
        met(x[f[k]] + 1e-12 * (middle - x[f[k]]));
        met(x[f[k]] + r.number(0, 1) * (x[f[(k + 1) % 3]] - x[f[k]]) + 1e-12 * (middle - x[f[k]]));
      }
  }
}

TEST(ConvexSearch, WindingByRay_DistinguishesInsideFromOutside) {
  Soup soup;
  for (const auto &f : kCubeFaces) soup.add(kCube[f[0]], kCube[f[1]], kCube[f[2]]);
  const dfm::Triangles m = soup.renew();
  Random r;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p = Vec3{0.5, 0.5, 0.5} + r.in_box(1);
    const bool inside = p.x > 0 && p.x < 1 && p.y > 0 && p.y < 1 && p.z > 0 && p.z < 1;
    ASSERT_EQ(dfm::winding_by_ray(m, p), inside ? 1 : 0) << p.x << " " << p.y << " " << p.z;
  }
  EXPECT_EQ(dfm::winding_by_ray(m, {0.5, 0.5, 0.5}), 1) << "rays through edges of the mesh";
}
