// The judge of "nothing passes through" is itself judged on pairs whose answer is known.
#include "crossing.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

using crossing::Counter;
using crossing::Surface;
using crossing::Touching;

namespace {

struct Tri {
  double p[3][3];
  const double *const *ptr() {
    for (int i = 0; i < 3; ++i) pointers[i] = p[i];
    return pointers;
  }
  const double *pointers[3];
};

// Every answer must hold for all orders of corners and of the two triangles.
struct Outcome { bool meet, pass; };
Outcome request(const Tri &a, const Tri &b) {
  const int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  Outcome first = {};
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      const double *pa[3], *pb[3];
      for (int k = 0; k < 3; ++k) {
        pa[k] = a.p[orders[i][k]];
        pb[k] = b.p[orders[j][k]];
      }
      const Outcome now = {crossing::meet(pa, pb), crossing::pass_through(pa, pb)};
      EXPECT_EQ(now.meet, crossing::meet(pb, pa));
      EXPECT_EQ(now.pass, crossing::pass_through(pb, pa));
      if (i == 0 && j == 0) first = now;
      EXPECT_EQ(now.meet, first.meet);
      EXPECT_EQ(now.pass, first.pass);
    }
  }
  return first;
}

const Tri kFlat = {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {}};

void expect(const Tri &b, bool meet, bool pass) {
  const Outcome outcome = request(kFlat, b);
  EXPECT_EQ(outcome.meet, meet);
  EXPECT_EQ(outcome.pass, pass);
}

}  // namespace

TEST(Crossing, PlainCrossing_Counts) { expect({{{1, 1, -1}, {1, 1, 1}, {2, 1, 1}}, {}}, true, true); }
TEST(Crossing, CornerThroughFace_Counts) { expect({{{1, 1, -1e-12}, {2, 1, 1}, {1, 2, 1}}, {}}, true, true); }
TEST(Crossing, CornerJustAboveFace_DoesNotCount) {
  expect({{{1, 1, 1e-300}, {2, 1, 1}, {1, 2, 1}}, {}}, false, false);
}
TEST(Crossing, CornerOnFace_TouchesOnly) { expect({{{1, 1, 0}, {2, 1, 1}, {1, 2, 1}}, {}}, true, false); }
TEST(Crossing, EdgeOnFace_TouchesOnly) { expect({{{1, 1, 0}, {2, 1, 0}, {1, 2, 1}}, {}}, true, false); }
TEST(Crossing, CornerOnCorner_TouchesOnly) { expect({{{0, 0, 0}, {-1, 0, 1}, {0, -1, 1}}, {}}, true, false); }
TEST(Crossing, CornerInPlaneOutsideFace_DoesNotCount) {
  expect({{{3, 3, 0}, {4, 4, 1}, {4, 3, 1}}, {}}, false, false);
}
TEST(Crossing, CoplanarOverlap_TouchesOnly) { expect({{{1, 1, 0}, {5, 1, 0}, {1, 5, 0}}, {}}, true, false); }
TEST(Crossing, CoplanarInside_TouchesOnly) {
  expect({{{1, 1, 0}, {1.5, 1, 0}, {1, 1.5, 0}}, {}}, true, false);
}
TEST(Crossing, CoplanarApart_DoesNotCount) { expect({{{3, 3, 0}, {5, 3, 0}, {3, 5, 0}}, {}}, false, false); }
TEST(Crossing, ParallelCloseBy_DoesNotCount) {
  expect({{{0, 0, 1e-12}, {4, 0, 1e-12}, {0, 4, 1e-12}}, {}}, false, false);
}
TEST(Crossing, SpansPlaneButMissesFace_DoesNotCount) {
  expect({{{5, 5, -1}, {5, 5, 1}, {6, 5, 1}}, {}}, false, false);
}
TEST(Crossing, EdgeOnEdge_TouchesOnly) { expect({{{2, 0, -1}, {2, 0, 1}, {2, -3, 1}}, {}}, true, false); }
TEST(Crossing, BothHaveACornerInTheOthersPlane_Counts) {
  // The common segment runs from a corner of one to a corner of the other: no edge strictly pierces a face.
  const Tri a = {{{0, 0, 0}, {4, -1, 0}, {4, 1, 0}}, {}}, b = {{{5, 0, 0}, {-1, 0, -1}, {-1, 0, 1}}, {}};
  EXPECT_TRUE(request(a, b).meet);
  EXPECT_TRUE(request(a, b).pass);
}
TEST(Crossing, NoArea_CountsAsItsEdges) {
  expect({{{1, 1, -1}, {1, 1, 0}, {1, 1, 1}}, {}}, true, false);
  expect({{{5, 5, -1}, {5, 5, 0}, {5, 5, 1}}, {}}, false, false);
}

TEST(Crossing, FarFromOrigin_IsExact) {
  // One unit in the last place above and below a plane, at coordinates where rounding swallows
  // naive determinants.
  const double big = 1048576.1, up = std::nextafter(big, INFINITY), down = std::nextafter(big, -INFINITY);
  const Tri flat = {{{big, big, big}, {big + 3.3, big, big}, {big, big + 3.3, big}}, {}};
  const Tri above = {{{big + 1, big + 1, up}, {big + 1.1, big + 1, big + 1}, {big + 1, big + 1.2, big + 1}},
                     {}};
  const Tri on = {{{big + 1, big + 1, big}, {big + 1.1, big + 1, big + 1}, {big + 1, big + 1.2, big + 1}},
                  {}};
  const Tri through = {
      {{big + 1, big + 1, down}, {big + 1.1, big + 1, big + 1}, {big + 1, big + 1.2, big + 1}}, {}};
  EXPECT_FALSE(request(flat, above).meet);
  EXPECT_TRUE(request(flat, on).meet);
  EXPECT_FALSE(request(flat, on).pass);
  EXPECT_TRUE(request(flat, through).pass);
}

TEST(Crossing, Orientation_AgreesWithWholeNumbers) {
  // Points of a fine grid near one plane: every determinant is a whole number that 128-bit arithmetic
  // gives exactly.
  std::mt19937_64 random(7);
  int zeros = 0;
  for (int n = 0; n < 20000; ++n) {
    int64_t p[4][3];
    double x[4][3];
    for (auto &q : p) {
      q[0] = int64_t(random() % 4000001) - 2000000;
      q[1] = int64_t(random() % 4000001) - 2000000;
      q[2] = 3 * q[0] - 2 * q[1] + 5;
    }
    p[3][2] += int64_t(random() % 3) - 1;
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 3; ++k) x[i][k] = double(p[i][k]) * 0x1p-40;
    __extension__ using Wide = __int128;
    Wide m[3][3];
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) m[i][k] = p[i][k] - p[3][k];
    const Wide det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                     m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                     m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    const int expected = det > 0 ? 1 : det < 0 ? -1 : 0;
    zeros += expected == 0;
    ASSERT_EQ(crossing::orientation(x[0], x[1], x[2], x[3]), expected) << "case " << n;
  }
  EXPECT_GT(zeros, 5000);
}

namespace {

// A closed unit box of 12 triangles moved by a shift.
struct BoxMesh {
  std::vector<double> xyz;
  std::vector<uint32_t> tri = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                               2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  explicit BoxMesh(double x, double y, double z) {
    for (int i = 0; i < 8; ++i) xyz.insert(xyz.end(), {x + (i & 1), y + ((i >> 1) & 1), z + ((i >> 2) & 1)});
  }
  Surface surface() const { return {xyz.data(), 8, tri.data(), 12}; }
};

size_t count(const std::vector<Surface> &s, Touching touching) {
  Counter counter;
  return counter.count(s, touching).all();
}

}  // namespace

TEST(Counter, OneClosedBox_HasNone) {
  const BoxMesh a(0, 0, 0);
  EXPECT_EQ(count({a.surface()}, Touching::counts), 0u);
}

TEST(Counter, BoxesApart_HaveNone) {
  const BoxMesh a(0, 0, 0), b(0, 0, 1 + 1e-12);
  EXPECT_EQ(count({a.surface(), b.surface()}, Touching::counts), 0u);
}

TEST(Counter, BoxOnBox_TouchingCountsOnlyOnRequest) {
  const BoxMesh a(0, 0, 0), b(0.25, 0.25, 1);
  EXPECT_GT(count({a.surface(), b.surface()}, Touching::counts), 0u);
  EXPECT_EQ(count({a.surface(), b.surface()}, Touching::allowed), 0u);
}

TEST(Counter, BoxesThatOverlap_CountInBothWays) {
  const BoxMesh a(0, 0, 0), b(0.3, 0.4, 0.9);
  EXPECT_GT(count({a.surface(), b.surface()}, Touching::counts), 0u);
  EXPECT_GT(count({a.surface(), b.surface()}, Touching::allowed), 0u);
}

TEST(Counter, AlignedBoxesThatOverlap_AreFoundAsTouching) {
  // All faces are coplanar or parallel: nothing passes strictly, but committed states may not even touch.
  const BoxMesh a(0, 0, 0), b(0, 0, 0.9);
  EXPECT_GT(count({a.surface(), b.surface()}, Touching::counts), 0u);
}

TEST(Counter, TwoFlatSheets_GiveTheExactNumber) {
  // A fan of n triangles around the axis, and one sheet that cuts m of them.
  std::vector<double> fan = {0, 0, 0}, sheet = {0.5, -0.01, -1, 0.5, -0.01, 1, 0.5, 0.3, 0};
  std::vector<uint32_t> fan_tri, sheet_tri = {0, 1, 2};
  const int n = 24;
  for (int i = 0; i <= n; ++i)
    fan.insert(fan.end(), {std::cos(6.2831853 * i / n), std::sin(6.2831853 * i / n), 0});
  for (uint32_t i = 1; i <= uint32_t(n); ++i) fan_tri.insert(fan_tri.end(), {0, i, i + 1});
  // The sheet cuts z = 0 from y = -0.01 to 0.3 at x = 0.5; a sector spans 15 degrees: tan 15 = 0.134, tan 30
  // = 0.289, tan 45 = 0.5.
  const Surface a = {fan.data(), uint32_t(fan.size() / 3), fan_tri.data(), n};
  const Surface b = {sheet.data(), 3, sheet_tri.data(), 1};
  // sectors -15..0, 0..15, 15..30 (to y 0.289) and 30..45 (from 0.289 to 0.3)
  EXPECT_EQ(count({a, b}, Touching::counts), 4u);
}

TEST(Counter, ManyRandomTriangles_AgreeWithAllPairs) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place(0, 1), shape(-0.06, 0.06);
  std::vector<double> xyz[2];
  std::vector<uint32_t> tri[2];
  for (int s = 0; s < 2; ++s) {
    for (uint32_t t = 0; t < 400; ++t) {
      const double c[3] = {place(random), place(random), place(random)};
      for (uint32_t k = 0; k < 3; ++k) {
        for (double x : c) xyz[s].push_back(x + shape(random));
        tri[s].push_back(3 * t + k);
      }
    }
  }
  size_t expected = 0;
  for (size_t i = 0; i < 800; ++i) {
    for (size_t j = i + 1; j < 800; ++j) {
      const double *a[3], *b[3];
      for (size_t k = 0; k < 3; ++k) {
        a[k] = &xyz[i / 400][9 * (i % 400) + 3 * k];
        b[k] = &xyz[j / 400][9 * (j % 400) + 3 * k];
      }
      expected += crossing::meet(a, b);
    }
  }
  EXPECT_GT(expected, 50u);
  EXPECT_EQ(count({{xyz[0].data(), 1200, tri[0].data(), 400}, {xyz[1].data(), 1200, tri[1].data(), 400}},
                  Touching::counts),
            expected);
}

TEST(Crossing, RandomTriangles_PassWhereTheyMeet) {
  // In general position triangles cannot merely touch.
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> place(0, 1);
  int meeting = 0;
  for (int n = 0; n < 20000; ++n) {
    double x[6][3];
    const double *a[3], *b[3];
    for (auto &p : x)
      for (double &c : p) c = place(random);
    for (int i = 0; i < 3; ++i) {
      a[i] = x[i];
      b[i] = x[3 + i];
    }
    ASSERT_EQ(crossing::meet(a, b), crossing::pass_through(a, b)) << "case " << n;
    meeting += crossing::meet(a, b);
  }
  EXPECT_GT(meeting, 1000);
}

TEST(Counter, SelfPairsThatShareAVertex_AreExcepted) {
  // Two triangles that share corner 0 and fold through each other: excepted; without the common corner the
  // same shapes count.
  const std::vector<double> xyz = {0, 0, 0, 2, 0, 0, 0, 2, 0, 1, 0.5, -1, 1, 0.5, 1};
  const std::vector<uint32_t> shared = {0, 1, 2, 0, 3, 4};
  EXPECT_EQ(count({{xyz.data(), 5, shared.data(), 2}}, Touching::counts), 0u);
  const std::vector<double> split = {0, 0, 0, 2, 0, 0, 0, 2, 0, 1, 0.5, -1, 1, 0.5, 1, 0.01, 0, 0};
  const std::vector<uint32_t> apart = {0, 1, 2, 5, 3, 4};
  EXPECT_EQ(count({{split.data(), 6, apart.data(), 2}}, Touching::counts), 1u);
}

// A body against an obstacle counts; an obstacle against itself or another one does not.
TEST(Counter, Obstacles_CountAgainstBodiesOnly) {
  const double upright[9] = {-1, 0, -1, 1, 0, -1, 0, 0, 1}, level[9] = {-1, -1, 0, 1, -1, 0, 0, 1, 0};
  const uint32_t tri[3] = {0, 1, 2};
  Counter counter;
  const auto count = [&](bool a, bool b) {
    return counter.count({{upright, 3, tri, 1, a}, {level, 3, tri, 1, b}}, Touching::counts).all();
  };
  EXPECT_EQ(count(false, false), 1u);
  EXPECT_EQ(count(true, false), 1u);
  EXPECT_EQ(count(false, true), 1u);
  EXPECT_EQ(count(true, true), 0u);
}

// Faces of a cut lie on each other, so a crossing of two of them counts from a depth on.
TEST(Counter, CutSurfaces_CrossBeyondADepth) {
  const uint32_t tri[3] = {0, 1, 2};
  const double level[9] = {-1, -1, 0, 1, -1, 0, 0, 1, 0};
  for (const double deep : {0.002, 0.1}) {
    const double upright[9] = {-1, 0, 1, 1, 0, 1, 0, 0, -deep};
    const double *a[3] = {upright, upright + 3, upright + 6}, *b[3] = {level, level + 3, level + 6};
    EXPECT_NEAR(crossing::depth(a, b), deep, 1e-15);
    EXPECT_NEAR(crossing::depth(b, a), deep, 1e-15);
    Counter counter;
    const auto count = [&](bool first, bool second) {
      return counter
          .count({{upright, 3, tri, 1, false, first}, {level, 3, tri, 1, false, second}}, Touching::counts)
          .all();
    };
    EXPECT_EQ(count(false, true), 1u);
    EXPECT_EQ(count(true, true), deep > crossing::kLaid * 2 ? 1u : 0u);
  }
  const double far[9] = {5, 0, -1, 6, 0, -1, 5, 0, 1};
  const double *a[3] = {far, far + 3, far + 6}, *b[3] = {level, level + 3, level + 6};
  EXPECT_LT(crossing::depth(a, b), 0);
}
