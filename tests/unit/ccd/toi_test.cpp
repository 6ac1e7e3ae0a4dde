// Time of impact of hand-made queries: every kind of first touch, the motions without a change of sign,
// separations, scales.
#include <gtest/gtest.h>

#include "toi_support.h"

namespace {

using namespace test;

using P = std::array<double, 3>;
ToiQuery query(bool edges, std::array<P, 4> from, std::array<P, 4> to) {
  ToiQuery q;
  q.edges = edges;
  for (int k = 0; k < 4; ++k)
    for (int i = 0; i < 3; ++i) {
      q.m[k].p0[i] = from[size_t(k)][size_t(i)];
      q.m[k].p1[i] = to[size_t(k)][size_t(i)];
    }
  return q;
}
// A point that moves over or onto the triangle (0,0,0) (4,0,0) (0,4,0) at rest.
ToiQuery point_on_still(P from, P to) {
  const P a = {0, 0, 0}, b = {4, 0, 0}, c = {0, 4, 0};
  return query(false, {from, a, b, c}, {to, a, b, c});
}
// An edge that moves from (a0, b0) to (a1, b1) over the edge (-2,0,0) (2,0,0) at rest.
ToiQuery edge_on_still(P a0, P b0, P a1, P b1) {
  const P c = {-2, 0, 0}, d = {2, 0, 0};
  return query(true, {a0, b0, c, d}, {a1, b1, c, d});
}

void expect_time(const ToiQuery &q, double time, const char *what, double separation = 0) {
  for (int method = 0; method < 4; ++method) {
    const double t = request(q, method, separation).t;
    if (time > 1) {
      EXPECT_EQ(t, kNever) << what << ", " << kFinderNames[method];
    } else if (method == DFM_TOI_CONSERVATIVE) {
      EXPECT_LE(t, time) << what;
      EXPECT_LE(double(distance_at(q, Real(t))), separation + 2e-12 * extent_of(q)) << what;
    } else {
      EXPECT_NEAR(t, time, 1e-10) << what << ", " << kFinderNames[method];
    }
  }
}

}  // namespace

TEST(Toi, PointThroughFace_TimeAndWeights) {
  const ToiQuery q = point_on_still({1, 2, 3}, {1, 2, -1});
  expect_time(q, 0.75, "straight down");
  for (int method = 0; method < 4; ++method) {
    const ToiResult a = request(q, method);
    EXPECT_NEAR(a.at[0], 0.25, 1e-10);
    EXPECT_NEAR(a.at[1], 0.25, 1e-10);
    EXPECT_NEAR(a.at[2], 0.5, 1e-10);
  }
}

TEST(Toi, EdgeOverEdge_TimeAndPlaces) {
  const ToiQuery q = edge_on_still({1, -3, 1}, {1, 1, 1}, {1, -3, -3}, {1, 1, -3});
  expect_time(q, 0.25, "crossed");
  ToiQuery swapped = q;
  std::swap(swapped.m[0], swapped.m[2]);
  std::swap(swapped.m[1], swapped.m[3]);
  for (int method = 0; method < 4; ++method) {
    const ToiResult a = request(q, method), b = request(swapped, method);
    EXPECT_NEAR(a.at[0], 0.75, 1e-10);
    EXPECT_NEAR(a.at[1], 0.75, 1e-10);
    EXPECT_EQ(a.at[0], b.at[1]);
    EXPECT_EQ(a.at[1], b.at[0]);
  }
}

// The counter-example to (4.5) in doc/reference/zerbato.md: the triangle's three vertices move differently.
TEST(Toi, DeformingTriangle_MeetsPointAtRest) {
  const P o = {0, 0, 0};
  const ToiQuery q = query(false, {o, P{-1, -1, 0.2}, P{3, -1, 0.2}, P{-1, 1, 0.6}},
                           {o, P{-1, -1, 0.6}, P{3, -1, 0.6}, P{-1, 1, -1.4}});
  expect_time(q, 0.5, "counter-example");
  const ToiResult a = request(q, DFM_TOI_CONSERVATIVE);
  EXPECT_NEAR(a.at[0], 0.25, 1e-9);
  EXPECT_NEAR(a.at[1], 0.25, 1e-9);
}

// Queries whose cubic changes its sign more than once, the first time while the point is beside the triangle:
// the roots come from dense sampling.
TEST(Toi, SeveralRoots_EarliestAdmissibleOneCounts) {
  Random random(21);
  int later = 0, beside = 0;
  for (int n = 0; n < 3000; ++n) {
    ToiQuery q;
    for (dfm_motion &m : q.m)
      for (int i = 0; i < 3; ++i) {
        m.p0[i] = random.real(-1, 1);
        m.p1[i] = random.real(-1, 1);
      }
    const auto plane = [&](Real t) {
      const Real3 a = at(q.m[1], t);
      return dot(at(q.m[0], t) - a, cross(at(q.m[2], t) - a, at(q.m[3], t) - a));
    };
    int roots = 0;
    double expected = kNever;
    for (int k = 0; k < 400 && expected > 1; ++k) {
      Real lo = Real(k) / 400, hi = Real(k + 1) / 400;
      if ((plane(lo) > 0) == (plane(hi) > 0)) continue;
      ++roots;
      for (int halving = 0; halving < 60; ++halving)
        ((plane(0.5L * (lo + hi)) > 0) == (plane(lo) > 0) ? lo : hi) = 0.5L * (lo + hi);
      if (distance_at(q, lo) < 1e-12) expected = double(lo);
    }
    if (roots < 2) continue;
    ++(expected <= 1 ? later : beside);
    for (int method = 0; method < 4; ++method) {
      const double t = request(q, method).t;
      ASSERT_EQ(t <= 1, expected <= 1) << n << " " << kFinderNames[method];
      if (t <= 1) {
        ASSERT_NEAR(t, expected, 1e-10) << n << " " << kFinderNames[method];
      }
    }
  }
  EXPECT_GT(later, 20);
  EXPECT_GT(beside, 100);
}

TEST(Toi, MotionInOnePlane_MeetsBorder) {
  expect_time(point_on_still({1, -3, 0}, {1, 1, 0}), 0.75, "point to side");
  expect_time(point_on_still({-2, -2, 0}, {2, 2, 0}), 0.5, "point to corner");
  expect_time(point_on_still({-1, -2, 0}, {3, -2, 0}), kNever, "past");
  expect_time(point_on_still({-4, 0, 0}, {4, 0, 0}), 0.5, "along a side");
  expect_time(edge_on_still({-5, 1, 0}, {-5, -1, 0}, {3, 1, 0}, {3, -1, 0}), 0.375, "edge to end");
  expect_time(edge_on_still({-6, 0, 0}, {-4, 0, 0}, {-2, 0, 0}, {0, 0, 0}), 0.5, "collinear, end to end");
  expect_time(edge_on_still({-6, 0, 0}, {-4, 0, 0}, {-5, 0, 0}, {-3, 0, 0}), kNever, "collinear, too slow");
  expect_time(edge_on_still({-1, 2, 0}, {1, 2, 0}, {-1, -2, 0}, {1, -2, 0}), 0.5, "parallel, in one plane");
  expect_time(edge_on_still({-1, 2, 1}, {1, 2, 1}, {-1, -2, -1}, {1, -2, -1}), 0.5, "parallel, aslant");
}

TEST(Toi, BorderOfFeatures_Counts) {
  expect_time(point_on_still({0, 0, 1}, {0, 0, -1}), 0.5, "through a corner");
  expect_time(point_on_still({2, 2, 1}, {2, 2, -1}), 0.5, "through a side");
  expect_time(point_on_still({2, 2.0000001, 1}, {2, 2.0000001, -1}), kNever, "past a side");
  expect_time(edge_on_still({2, -1, 1}, {2, 1, 1}, {2, -1, -1}, {2, 1, -1}), 0.5, "at an end");
  expect_time(edge_on_still({2, 0, 1}, {2, 1, 1}, {2, 0, -1}, {2, 1, -1}), 0.5, "end on end");
  expect_time(edge_on_still({2.0000001, -1, 1}, {2.0000001, 1, 1}, {2.0000001, -1, -1}, {2.0000001, 1, -1}),
              kNever, "past an end");
}

TEST(Toi, BeginAndEndOfStep_Count) {
  expect_time(point_on_still({1, 1, 0}, {1, 1, 5}), 0, "touches and leaves");
  expect_time(point_on_still({1, 1, 5}, {1, 1, 0}), 1, "arrives at the end");
  expect_time(point_on_still({1, 1, 5}, {1, 1, 1e-6}), kNever, "nearly arrives");
  expect_time(point_on_still({1, 1, 0}, {1, 1, 0}), 0, "rests on it");
  expect_time(point_on_still({1, 1, 1e-9}, {1, 1, 1e-9}), kNever, "rests above it");
  expect_time(edge_on_still({0, 0, 0}, {0, 0, 2}, {0, 0, 0}, {0, 0, 2}), 0, "rests on an edge");
}

// A tilting triangle z = (1 - s) y under a point at y = 1 + s, z = height, with s = t - 1/2: the gap is
// height - 1 + s^2.
TEST(Toi, GrazingTouch_IsFound) {
  const auto tilting = [](double height) {
    const P a = {0, 0, 0}, b = {4, 0, 0};
    return query(false, {P{1, 0.5, height}, a, b, P{0, 4, 6}}, {P{1, 1.5, height}, a, b, P{0, 4, 2}});
  };
  expect_time(tilting(1 - 0x1p-30), 0.5 - 0x1p-15, "through and back");
  expect_time(tilting(1 + 0x1p-30), kNever, "nearly");
  for (int method = 0; method < 4; ++method) {
    const double t = request(tilting(1), method).t;
    EXPECT_LE(t, method == DFM_TOI_CONSERVATIVE ? 0.5 : 0.5 + 1e-9) << kFinderNames[method];
    EXPECT_LE(double(distance_at(tilting(1), Real(t))), 1e-11) << kFinderNames[method];
  }
}

TEST(Toi, FeaturesWithoutExtent_AreTheirPoints) {
  const P o = {0, 0, 0}, up = {0, 0, 1}, down = {0, 0, -1};
  expect_time(query(false, {up, o, o, o}, {down, o, o, o}), 0.5, "a triangle that is a point");
  expect_time(query(false, {P{1, 0, 1}, o, o, o}, {P{1, 0, -1}, o, o, o}), kNever, "beside that");
  expect_time(query(false, {up, P{-1, 0, 0}, o, P{1, 0, 0}}, {down, P{-1, 0, 0}, o, P{1, 0, 0}}), 0.5,
              "a triangle that is a line");
  expect_time(query(false, {P{0, 1, 0}, P{-1, 0, 0}, P{3, 0, 0}, P{1, 0, 0}},
                    {P{4, -1, 0}, P{-1, 0, 0}, P{3, 0, 0}, P{1, 0, 0}}),
              0.5, "aslant onto that");
  expect_time(query(true, {up, up, P{-1, 0, 0}, P{1, 0, 0}}, {down, down, P{-1, 0, 0}, P{1, 0, 0}}), 0.5,
              "an edge that is a point");
  expect_time(query(true, {up, up, o, o}, {down, down, o, o}), 0.5, "two edges that are points");
  // Flat only in the middle of the step, when the point is there.
  expect_time(query(false, {P{0, 0, 1}, P{-1, 0, 0}, P{1, 0, 0}, P{0, 2, 0}},
                    {P{0, 0, -1}, P{-1, 0, 0}, P{1, 0, 0}, P{0, -2, 0}}),
              0.5, "flips");
}

TEST(Toi, CommonMotion_ChangesNothing) {
  for (const double speed : {1.0, 64.0, 4096.0}) {
    ToiQuery q = point_on_still({1, 1, 1}, {1, 1, 1});
    for (dfm_motion &m : q.m) {
      m.p1[0] += speed;
      m.p1[2] -= 3 * speed;
    }
    expect_time(q, kNever, "rigid");
    q.m[0].p1[2] -= 2;
    expect_time(q, 0.5, "rigid, and 2 down");
  }
}

TEST(Toi, MinSeparation_FirstTimeAtThatDistance) {
  expect_time(point_on_still({1, 1, 1}, {1, 1, -1}), 0.375, "over the face", 0.25);
  expect_time(point_on_still({2, -5, 0}, {2, 3, 0}), 0.5, "to a side", 1);
  expect_time(point_on_still({-8, 0, 0}, {0, 0, 0}), 0.75, "to a corner", 2);
  expect_time(point_on_still({1, 1, 1}, {1, 1, -1}), 0, "nearer from the start", 1.5);
  expect_time(point_on_still({1, 1, 5}, {1, 1, 2}), kNever, "never that near", 1.5);
  expect_time(edge_on_still({0, -1, 4}, {0, 1, 4}, {0, -1, 0}, {0, 1, 0}), 0.5, "edge over edge", 2);
  expect_time(edge_on_still({5, 0, 0}, {6, 0, 0}, {3, 0, 0}, {4, 0, 0}), 0.5, "end to end", 2);
  expect_time(edge_on_still({-1, 0, 4}, {1, 0, 4}, {-1, 0, 0}, {1, 0, 0}), 0.5, "parallel", 2);
}

TEST(Toi, Bits_DoNotDependOnUnitOriginOrOrder) {
  const ToiQuery q = query(false, {P{0.375, 0.25, 1}, P{-1, -0.5, 0.125}, P{2, -1, 0}, P{0.5, 3, -0.25}},
                           {P{0.125, 0.75, -1.5}, P{-1, -1.5, 0.25}, P{2.5, -1, 0.5}, P{0.5, 2.5, 0.75}});
  for (int method = 0; method < 4; ++method) {
    const ToiResult plain = request(q, method);
    ASSERT_LE(plain.t, 1);
    for (const double scale : {0x1p-1000, 0x1p-900, 0x1p-60, 0x1p50, 0x1p950, 0x1p1020}) {
      ToiQuery scaled = q;
      for (dfm_motion &m : scaled.m)
        for (int i = 0; i < 3; ++i) {
          m.p0[i] *= scale;
          m.p1[i] *= scale;
        }
      EXPECT_EQ(request(scaled, method).t, plain.t) << scale;
    }
    ToiQuery moved = q;  // exact: all coordinates are eighths
    for (dfm_motion &m : moved.m)
      for (double *end : {m.p0, m.p1}) {
        end[0] += 10;
        end[1] += 20;
        end[2] += 30;
      }
    EXPECT_EQ(request(moved, method).t, plain.t);
    const int orders[5][3] = {{1, 3, 2}, {2, 1, 3}, {2, 3, 1}, {3, 1, 2}, {3, 2, 1}};
    for (const auto &order : orders) {
      ToiQuery other = q;
      for (int k = 0; k < 3; ++k) other.m[k + 1] = q.m[order[k]];
      const ToiResult a = request(other, method);
      EXPECT_EQ(a.t, plain.t);
      for (int k = 0; k < 3; ++k) EXPECT_EQ(a.at[k], plain.at[order[k] - 1]);
    }
  }
}

TEST(Toi, LargestNumbers_DoNotOverflow) {
  const double far = 0x1.8p1023;  // twice that is no number any more
  const P a = {0, 0, -far};
  const P b = {4e300, 0, -far};
  const P c = {0, 4e300, -far};
  const P d = {0, 0, far};
  const P e = {4e300, 0, far};
  const P f = {0, 4e300, far};
  expect_time(query(false, {P{1e300, 1e300, far}, a, b, c}, {P{1e300, 1e300, -far}, d, e, f}), 0.5,
              "triangle and point fall past each other");
}

// With too few iterations the conservative answer is early, never late and never a miss.
TEST(Toi, IterationCap_StaysOnTheSafeSide) {
  Random random(3);
  int capped = 0;
  for (int n = 0; n < 3000; ++n) {
    ToiQuery q;
    q.edges = n & 1;
    for (dfm_motion &m : q.m)
      for (int i = 0; i < 3; ++i) {
        m.p0[i] = random.real(-1, 1);
        m.p1[i] = random.real(-1, 1);
      }
    const double t = request(q, DFM_TOI_CONSERVATIVE).t;
    for (const int cap : {1, 3, 6}) {
      const double early = request(q, DFM_TOI_CONSERVATIVE, 0, 0, cap).t;
      EXPECT_LE(early, t) << n << " cap " << cap;
      capped += early < t;
    }
  }
  EXPECT_GT(capped, 100);
}

// Zerbato 2010, (4.7), corrected: with the distance to the plane 42, 7.5 and 7 values for one root at 1e-12;
// Brent below 15.
TEST(Toi, Evaluations_AreThoseOfTheMethods) {
  Random random(4);
  double sum[3] = {};
  int hits = 0;
  for (int n = 0; n < 2000; ++n) {
    ToiQuery q;
    for (dfm_motion &m : q.m)
      for (int i = 0; i < 3; ++i) {
        m.p0[i] = random.real(-1, 1);
        m.p1[i] = m.p0[i] + random.real(-0.2, 0.2);
      }
    q.m[0].p0[2] = 1;
    q.m[0].p1[2] = -1;
    if (request(q, DFM_TOI_BRENT).t > 1) continue;
    ++hits;
    for (int method = 0; method < 3; ++method) sum[method] += request(q, method).evaluations;
  }
  ASSERT_GT(hits, 100);
  EXPECT_NEAR(sum[DFM_TOI_BISECTION] / hits, 42, 6);
  EXPECT_LT(sum[DFM_TOI_REGULA_FALSI] / hits, 12);
  EXPECT_LT(sum[DFM_TOI_BRENT] / hits, 12);
}
