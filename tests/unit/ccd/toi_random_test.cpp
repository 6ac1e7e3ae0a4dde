// Random queries against three oracles that share no code with the library: integer arithmetic on small whole
// coordinates, touches built to be exact, and dense sampling of the distance in long double.
#include <gtest/gtest.h>

#include <cstring>

#include "toi_support.h"

namespace {

using namespace test;

// ---- integer oracle ---------------------------------------------------------------------------------------

using Whole = __int128;
struct Whole3 { Whole x, y, z; };
Whole3 operator-(Whole3 a, Whole3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Whole dot(Whole3 a, Whole3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Whole3 cross(Whole3 a, Whole3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// times are k / kGrid; coordinates within 6 keep every product below 2^127
constexpr int64_t kGrid = 1 << 24;

struct Verdict {
  bool sure = false, hit = false;
  double from = 0, to = 0;  // the exact time lies in there
};

class Oracle {
 public:
  explicit Oracle(const ToiQuery &q) : q_(q) {}

  Verdict decide() {
    Verdict none;
    double turns[3] = {1, 1, 1};
    const int nturn = turning_points(turns);
    if (turns[1] < turns[0]) std::swap(turns[0], turns[1]);
    int64_t begin = 0;
    if (plane(0) == 0 && !touch_at_grid(0, none)) return none;
    if (none.sure) return none;
    for (int k = 0; k < nturn; ++k) {
      const int64_t end = std::llround(turns[k] * double(kGrid));
      if (end <= begin) continue;
      const Whole f0 = plane(begin), f1 = plane(end);
      // Near a turning point only a clear value tells the sign around it.
      if (f1 == 0 || (end != kGrid && std::fabs(double(f1)) < 1e-5 * scale())) return none;
      if (f0 != 0 && (f0 > 0) != (f1 > 0)) {
        int64_t lo = begin, hi = end;
        while (hi - lo > 1) {
          const int64_t middle = (lo + hi) / 2;
          const Whole f = plane(middle);
          if (f == 0) {
            if (!touch_at_grid(middle, none)) return none;
            if (none.sure) return none;
            lo = hi = middle;
          } else if ((f > 0) == (f0 > 0)) {
            lo = middle;
          } else {
            hi = middle;
          }
        }
        if (lo != hi) {
          const int inside = std::min(inside_at(lo), inside_at(hi));
          const int outside = std::max(inside_at(lo), inside_at(hi));
          if (inside > 0) return {true, true, double(lo) / kGrid, double(hi) / kGrid};
          if (outside >= 0) return none;
        }
      }
      begin = end;
    }
    none.sure = true;
    return none;
  }

 private:
  double scale() const { return 1e3 * std::pow(double(kGrid), 3); }
  Whole3 point(int vertex, int64_t k) const {
    const auto one = [&](int i) {
      return Whole(kGrid - k) * Whole(q_.m[vertex].p0[i]) + Whole(k) * Whole(q_.m[vertex].p1[i]);
    };
    return {one(0), one(1), one(2)};
  }
  void frame(int64_t k, Whole3 &r, Whole3 &e1, Whole3 &e2) const {  // the patch is r + u e1 + v e2
    const Whole3 a = point(0, k), b = point(1, k), c = point(2, k), d = point(3, k);
    if (q_.edges) {
      r = a - c;
      e1 = b - a;
      e2 = c - d;
    } else {
      r = a - b;
      e1 = b - c;
      e2 = b - d;
    }
  }
  Whole plane(int64_t k) const {
    Whole3 r, e1, e2;
    frame(k, r, e1, e2);
    return dot(r, cross(e1, e2));
  }
  // 1 the origin's foot is clearly in the patch, -1 clearly outside, 0 next to the border.
  int inside_at(int64_t k) const {
    Whole3 r, e1, e2;
    frame(k, r, e1, e2);
    const Whole3 n = cross(e1, e2);
    const double area2 = double(dot(n, n));
    const double u = double(dot(cross(e2, r), n)) / area2;
    const double v = double(dot(cross(r, e1), n)) / area2;
    if (area2 < 1e-3 * std::pow(double(kGrid), 4)) return 0;
    const double least = q_.edges ? std::min({u, v, 1 - u, 1 - v}) : std::min({u, v, 1 - u - v});
    return least > 1e-4 ? 1 : least < -1e-4 ? -1 : 0;
  }
  // Exactly in one plane at k / kGrid; false: too close to a border to call.
  bool touch_at_grid(int64_t k, Verdict &out) const {
    const int inside = inside_at(k);
    if (inside > 0) out = {true, true, double(k) / kGrid, double(k) / kGrid};
    return inside != 0;
  }
  // Zeros of the cubic's derivative and 1.
  int turning_points(double out[3]) const {
    const double s = std::pow(double(kGrid), 3);
    const double f[4] = {double(plane(0)) / s, double(plane(kGrid / 4)) / s, double(plane(kGrid / 2)) / s,
                         double(plane(kGrid)) / s};
    // The cubic through t = 0, 1/4, 1/2, 1 in Newton's form, then its derivative.
    const double x[4] = {0, 0.25, 0.5, 1};
    double d[4] = {f[0], f[1], f[2], f[3]};
    for (int level = 1; level < 4; ++level)
      for (int i = 3; i >= level; --i) d[i] = (d[i] - d[i - 1]) / (x[i] - x[i - level]);
    const double c3 = d[3];
    const double c2 = d[2] - d[3] * (x[0] + x[1] + x[2]);
    const double c1 = d[1] - d[2] * (x[0] + x[1]) + d[3] * (x[0] * x[1] + x[0] * x[2] + x[1] * x[2]);
    int n = 0;
    const double square = c2 * c2 - 3 * c3 * c1;
    if (square >= 0) {
      const double w = -(c2 + (c2 >= 0 ? 1 : -1) * std::sqrt(square));
      for (const double t : {w / (3 * c3), c1 / w})
        if (t > 0 && t < 1) out[n++] = t;
    }
    out[n++] = 1;
    return n;
  }

  const ToiQuery &q_;
};

ToiQuery whole_query(Random &random, bool edges) {
  ToiQuery q;
  q.edges = edges;
  for (dfm_motion &m : q.m)
    for (int i = 0; i < 3; ++i) {
      m.p0[i] = random.whole(-6, 6);
      m.p1[i] = random.whole(-6, 6);
    }
  return q;
}

// ---- touches that are exact by construction ---------------------------------------------------------------

// At t* = k/16 the point is at weights of sixteenths on the triangle (edges: at sixteenths on both); all
// numbers are small multiples of 1/256, so the ends of all paths, and with them the touch, are exact in
// doubles. `grazing`: the velocity along the normal is nearly or exactly the same there.
ToiQuery exact_touch(Random &random, double &time) {
  ToiQuery q;
  q.edges = random.next() & 1;
  const int at_time = random.whole(0, 16);
  time = at_time / 16.0;
  double x[4][3], v[4][3];
  const int style = random.whole(0, 5);
  for (int k = 0; k < 4; ++k)
    for (int i = 0; i < 3; ++i) {
      x[k][i] = random.whole(-16, 16);
      v[k][i] = random.whole(-16, 16);
      if (style == 1 && i == 2) v[k][i] = 0;                // motion in parallel planes
      if (style == 2 && i == 2) x[k][i] = v[k][i] = 0;      // motion in one plane
      if (style == 3 && k > 0) v[k][i] = v[0][i];           // a common translation
      if (style == 4) v[k][i] = k == 0 ? v[k][i] / 16 : 0;  // nearly at rest
    }
  if (style == 5)  // a sliver
    for (int i = 0; i < 3; ++i) x[3][i] = x[2][i] + (x[3][i] - x[2][i]) * 0x1p-20;
  const int wu = random.whole(0, 16), wv = random.whole(0, q.edges ? 16 : 16 - wu);
  for (int i = 0; i < 3; ++i) {
    // b's end is put where the point on a needs it: b0 such that b0 + wv/16 (b1 - b0) is on a
    if (q.edges) {
      const double on_a = (x[0][i] * (16 - wu) + x[1][i] * wu) / 16;
      const double on_b = (x[2][i] * (16 - wv) + x[3][i] * wv) / 16;
      x[2][i] += on_a - on_b;
      x[3][i] += on_a - on_b;
    } else {
      x[0][i] = (x[1][i] * (16 - wu - wv) + x[2][i] * wu + x[3][i] * wv) / 16;
    }
  }
  for (int k = 0; k < 4; ++k)
    for (int i = 0; i < 3; ++i) {
      q.m[k].p0[i] = x[k][i] - time * v[k][i];
      q.m[k].p1[i] = x[k][i] + (1 - time) * v[k][i];
    }
  return q;
}

ToiQuery real_query(Random &random, double motion) {
  ToiQuery q;
  q.edges = random.next() & 1;
  for (dfm_motion &m : q.m)
    for (int i = 0; i < 3; ++i) {
      m.p0[i] = random.real(-1, 1);
      m.p1[i] = m.p0[i] + motion * random.real(-1, 1);
    }
  return q;
}

}  // namespace

class ToiRandom : public testing::TestWithParam<int> {};

// unsanitized: too slow there; shorter tests run the same code
TEST_P(ToiRandom, WholeCoordinates_AgreeWithIntegerArithmetic) {
  Random random(11);
  int sure = 0, hits = 0;
  for (int n = 0; n < 20000; ++n) {
    const ToiQuery q = whole_query(random, n & 1);
    const Verdict truth = Oracle(q).decide();
    if (!truth.sure) continue;
    ++sure;
    hits += truth.hit;
    const double t = request(q, GetParam()).t;
    ASSERT_EQ(t <= 1, truth.hit) << n << " t " << t << " exact from " << truth.from;
    if (!truth.hit) continue;
    ASSERT_GE(t, truth.from - 1e-10) << n;
    ASSERT_LE(t, truth.to + (GetParam() == DFM_TOI_CONSERVATIVE ? 0 : 1e-10)) << n;
  }
  EXPECT_GT(sure, 18000);
  EXPECT_GT(hits, 2000);
}

TEST_P(ToiRandom, FindersAgreeOnEveryTime) {
  Random random(12);
  for (int n = 0; n < 20000; ++n) {
    const ToiQuery q = real_query(random, 2);
    const double t = request(q, GetParam()).t, other = request(q, DFM_TOI_BRENT).t;
    ASSERT_EQ(t <= 1, other <= 1) << n;
    if (t <= 1) {
      ASSERT_NEAR(t, other, 1e-10) << n;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Finders, ToiRandom, testing::Values(0, 1, 2, 3),
                         [](const auto &i) { return std::string(kFinderNames[i.param]); });

// 1e5 touches known to the last bit, many of them grazing, in one plane, at the border or at the
// ends of the step.
TEST(ToiConservative, ExactTouches_AreNeverMissedAndNeverLate) {
  Random random(13);
  for (int n = 0; n < 100000; ++n) {
    double time;
    const ToiQuery q = exact_touch(random, time);
    ASSERT_LE(distance_at(q, Real(time)), 1e-17 * extent_of(q)) << "the construction itself, " << n;
    const ToiResult a = request(q, DFM_TOI_CONSERVATIVE);
    ASSERT_LE(a.t, time) << n << (q.edges ? " edges" : " point");
    ASSERT_LE(distance_at(q, Real(a.t)), 2e-12L * Real(extent_of(q)))
        << n << ": called touching while apart, t " << a.t << " exact " << time << " evaluations "
        << a.evaluations;
    ASSERT_LT(a.evaluations, 512u) << n;
  }
}

// unsanitized: too slow there; shorter tests run the same code
TEST(ToiConservative, BeforeTheResult_FeaturesAreApart) {
  Random random(14);
  int hits = 0;
  for (int n = 0; n < 4000; ++n) {
    const ToiQuery q = real_query(random, n % 3 == 0 ? 0.3 : 3);
    const double separation = n % 2 ? 0 : random.real(0, 0.2);
    const ToiResult a = request(q, DFM_TOI_CONSERVATIVE, separation);
    const double end = std::min(a.t, 1.0);
    hits += a.t <= 1;
    for (int k = 0; k < 64 && end > 0; ++k) {
      const Real t = end * Real(k) / 64;
      ASSERT_GT(distance_at(q, t), separation) << n << " at " << double(t) << " before " << a.t;
    }
    if (a.t > 1) {
      ASSERT_GT(distance_at(q, 1), separation) << n;
    } else if (a.t > 0) {
      ASSERT_NEAR(double(distance_at(q, Real(a.t))), separation, 1e-11) << n;
    } else {
      ASSERT_LE(double(distance_at(q, 0)), separation + 1e-11) << n;
    }
  }
  EXPECT_GT(hits, 400);
}

TEST(ToiConservative, Separation_AllFindersAgree) {
  Random random(15);
  int hits = 0;
  for (int n = 0; n < 6000; ++n) {
    const ToiQuery q = real_query(random, 2);
    const double separation = random.real(1e-3, 0.3);
    const double t = request(q, DFM_TOI_CONSERVATIVE, separation).t;
    for (const int method : {DFM_TOI_BISECTION, DFM_TOI_REGULA_FALSI, DFM_TOI_BRENT}) {
      const double other = request(q, method, separation).t;
      ASSERT_EQ(t <= 1, other <= 1) << n << " " << kFinderNames[method];
      if (t <= 1) {
        ASSERT_LE(t, other + 1e-12) << n << " " << kFinderNames[method];
        // a grazing pass: the tolerance in distance is wide in time
        ASSERT_NEAR(t, other, 1e-7) << n << " " << kFinderNames[method];
      }
    }
    hits += t <= 1;
  }
  EXPECT_GT(hits, 1000);
}

// The same bits from every compiler, optimization and vector width; a change of the method changes the
// number, a change of the build may not.
TEST(Toi, Bits_AreThoseOfEveryBuild) {
  Random random(9);
  uint64_t hash = 14695981039346656037ull;  // FNV-1a
  const auto add = [&](double x) {
    uint64_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    for (int i = 0; i < 64; i += 8) hash = (hash ^ (bits >> i & 255)) * 1099511628211ull;
  };
  for (int n = 0; n < 4000; ++n) {
    const ToiQuery q = n % 4 < 2 ? real_query(random, 2) : whole_query(random, n & 1);
    for (int method = 0; method < 4; ++method) {
      const ToiResult a = request(q, method, n % 5 == 0 ? 0.05 : 0);
      add(a.t);
      if (a.t <= 1) {
        add(a.at[0]);
        add(a.at[1]);
      }
    }
  }
  EXPECT_EQ(hash, 17016981760266008452ull);
}
