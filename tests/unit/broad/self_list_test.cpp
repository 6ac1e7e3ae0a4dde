// Lists of a surface against itself: what they must hold, and that they hold it through motion.
#include "broad/self_list.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <random>
#include <set>

#include "body/make_surface.h"
#include "contact/reach.h"
#include "geometry/closest.h"

namespace dfm {
namespace {

// A sheet of n x n squares that folds: heights and speeds are the test's own.
Surface sheet(uint32_t n) {
  std::vector<double> points;
  std::vector<uint32_t> tris;
  for (uint32_t j = 0; j <= n; ++j)
    for (uint32_t i = 0; i <= n; ++i) points.insert(points.end(), {double(i), double(j), 0});
  for (uint32_t j = 0; j < n; ++j)
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      tris.insert(tris.end(), {a, b, d, a, d, c});
    }
  Surface s;
  make_surface(Memory::standard(), uint32_t(points.size() / 3), points.data(), tris.data(),
               uint32_t(tris.size() / 3), s);
  return s;
}

Vec3 at(const Surface &s, uint32_t surfel) { return load3(&s.x[4 * size_t{surfel}]); }

// Every surfel and triangle without it whose distance is within the reach of a contact now.
size_t expect_covers(const Surface &s, const SelfList &list, double h, double offset, const char *when) {
  std::set<std::pair<uint32_t, uint32_t>> listed;
  for (const SelfPair &p : list.vertex_face()) {
    EXPECT_TRUE(listed.insert({p.a, p.b}).second) << "a pair comes once";
    for (int k = 0; k < 3; ++k) EXPECT_NE(s.tri[3 * p.b + k], p.a);
  }
  size_t needed = 0;
  for (uint32_t p = 0; p < s.nsurfel; ++p)
    for (uint32_t t = 0; t < s.ntri; ++t) {
      const uint32_t *c = &s.tri[3 * t];
      if (c[0] == p || c[1] == p || c[2] == p) continue;
      double speed = 0;
      for (int k = 0; k < 3; ++k)
        speed = std::max(speed, norm(load3(&s.v[4 * size_t{p}]) - load3(&s.v[4 * size_t{c[k]}])));
      const double reach = contact_reach(h, offset, speed);
      if (closest_on_triangle(at(s, p), at(s, c[0]), at(s, c[1]), at(s, c[2])).distance2 >= reach * reach)
        continue;
      ++needed;
      EXPECT_TRUE(listed.count({p, t})) << when << ": surfel " << p << " is within reach of triangle " << t;
    }
  return needed;
}

// Every pair that is nearer than the list says it covers, once, in order.
size_t expect_lists_all(const Surface &s, const SelfList &list, const char *when) {
  const auto sorted = [](const Array<SelfPair> &pairs) {
    return std::is_sorted(pairs.begin(), pairs.end(),
                          [](auto &l, auto &r) { return l.a != r.a ? l.a < r.a : l.b < r.b; });
  };
  EXPECT_TRUE(sorted(list.vertex_face()) && sorted(list.edge_edge())) << when;
  const auto set_of = [](const Array<SelfPair> &pairs) {
    std::set<std::pair<uint32_t, uint32_t>> out;
    for (const SelfPair &p : pairs) EXPECT_TRUE(out.insert({p.a, p.b}).second) << "a pair comes once";
    return out;
  };
  const auto faces = set_of(list.vertex_face()), edges = set_of(list.edge_edge());
  const double limit2 = list.covered() * list.covered();
  size_t needed = 0;
  for (uint32_t p = 0; p < s.nsurfel; ++p)
    for (uint32_t t = 0; t < s.ntri; ++t) {
      const uint32_t *c = &s.tri[3 * t];
      if (c[0] == p || c[1] == p || c[2] == p ||
          !(closest_on_triangle(at(s, p), at(s, c[0]), at(s, c[1]), at(s, c[2])).distance2 < limit2))
        continue;
      ++needed;
      EXPECT_TRUE(faces.count({p, t})) << when << ": surfel " << p << " and triangle " << t;
    }
  for (uint32_t e = 0; e < s.nedge; ++e)
    for (uint32_t f = e + 1; f < s.nedge; ++f) {
      const uint32_t *a = &s.edge[2 * e], *b = &s.edge[2 * f];
      if (a[0] == b[0] || a[0] == b[1] || a[1] == b[0] || a[1] == b[1] ||
          !(closest_segments(at(s, a[0]), at(s, a[1]), at(s, b[0]), at(s, b[1])).distance2 < limit2))
        continue;
      ++needed;
      EXPECT_TRUE(edges.count({e, f})) << when << ": edges " << e << " and " << f;
    }
  return needed;
}

// A sheet that is rolled nearly to a tube and turns as a whole, with a dent that travels over it.
void dent(Surface &s, uint32_t n, double when, double h) {
  for (uint32_t i = 0; i < s.nsurfel; ++i) {
    const uint32_t point = i % ((n + 1) * (n + 1));  // copies follow
    const double u = point % (n + 1), v = point / (n + 1), a = 3.1 * (2 * u / n - 1), r = n / 6.2;
    const double du = u - 2 - 0.01 * when, dv = v - 0.5 * n, deep = 0.8 * std::exp(-du * du - dv * dv);
    const Vec3 x{(r - deep) * std::sin(a), v, -(r - deep) * std::cos(a)};
    const double turn = 1e-3 * when;
    const Vec3 before = at(s, i), now{std::cos(turn) * x.x - std::sin(turn) * x.y + 0.01 * when,
                                      std::sin(turn) * x.x + std::cos(turn) * x.y, x.z};
    store3(&s.x[4 * size_t{i}], now);
    store3(&s.v[4 * size_t{i}], when > 0 ? (1 / h) * (now - before) : Vec3{});
  }
}

}  // namespace

TEST(SelfList, LocalMotion_RenewsAPart) {
  constexpr uint32_t kSquares = 14;
  Surface s = sheet(kSquares);
  SelfList list(Memory::standard(), s);
  size_t needed = 0;
  for (int step = 0; step < 600 && !HasFailure(); ++step) {
    dent(s, kSquares, step, 0.01);
    if (list.update(0.01, 1e-3))
      needed += expect_lists_all(s, list, ("step " + std::to_string(step)).c_str());
    else if (step % 20 == 0) needed += expect_lists_all(s, list, "kept");
  }
  EXPECT_GT(needed, 1000u);
  EXPECT_GT(list.parts(), 10u) << "of " << list.renewals();
  EXPECT_LE(list.renewals() - list.parts(), list.parts());
}

// Cut along a line from one side to the middle: copies of its points follow the others, and the triangles on
// its right have them.
TEST(SelfList, Cut_ContinuesTheLists) {
  constexpr uint32_t kSquares = 14, kLine = 7, kDeep = 8, kPoints = (kSquares + 1) * (kSquares + 1);
  const Surface whole = sheet(kSquares);
  std::vector<double> points;
  for (uint32_t i = 0; i < kPoints; ++i) points.insert(points.end(), {double(i % 15), double(i / 15), 0});
  const auto on_line = [](uint32_t p) { return p % (kSquares + 1) == kLine && p / (kSquares + 1) < kDeep; };
  std::vector<uint32_t> tris(whole.tri.begin(), whole.tri.end()), copy(kPoints, kNone);
  for (uint32_t p = 0; p < kPoints; ++p) {
    if (!on_line(p)) continue;
    copy[p] = uint32_t(points.size() / 3);
    points.insert(points.end(), {double(p % 15), double(p / 15), 0});
  }
  FeatureMap map;
  for (auto &of : map.of) of.clear();
  for (uint32_t t = 0; t < whole.ntri; ++t) {
    double middle = 0;
    for (uint32_t k = 0; k < 3; ++k) middle += tris[3 * t + k] % (kSquares + 1) / 3.0;
    bool split = false;
    for (uint32_t k = 0; k < 3; ++k)
      if (uint32_t &p = tris[3 * t + k]; middle > kLine && on_line(p)) {
        p = copy[p];
        split = true;
      }
    map.of[2].push_back(split && t % 2 ? kNone : t);  // names may go to either side
  }
  Surface s;
  make_surface(Memory::standard(), uint32_t(points.size() / 3), points.data(), tris.data(),
               uint32_t(tris.size() / 3), s);
  ASSERT_EQ(s.nsurfel, kPoints + kDeep);
  for (uint32_t p = 0; p < kPoints; ++p) map.of[0].push_back(p);
  for (uint32_t e = 0; e < whole.nedge; ++e) {
    uint32_t now = kNone;
    for (uint32_t f = 0; f < s.nedge; ++f)
      if (s.edge[2 * f] == whole.edge[2 * e] && s.edge[2 * f + 1] == whole.edge[2 * e + 1]) now = f;
    map.of[1].push_back(now);
  }
  FeatureMap same;  // of a cut elsewhere, right after
  for (size_t kind = 0; kind < 3; ++kind) {
    same.of[kind].resize((std::array{s.nsurfel, s.nedge, s.ntri})[kind]);
    std::iota(same.of[kind].begin(), same.of[kind].end(), 0u);
  }
  // the lists before the cut are those of now, or were made once, ahead of it
  for (const auto &[moved, ahead] : {std::pair(false, false), {true, false}, {false, true}, {true, true}}) {
    Surface before = whole;
    SelfList first(Memory::standard(), before), second(Memory::standard(), s);
    for (int step = 0; step < 100; ++step) {
      dent(before, kSquares, step, 0.01);
      if (!ahead) first.update(0.01, 1e-3);
      else if (step == 70) first.update(0.01, 1e-3);
    }
    Array<uint8_t> marks(s.nsurfel, 0);
    for (uint32_t i = 0; moved && i < s.nsurfel; ++i) marks[i] = i >= kPoints || on_line(i);
    const auto set_back = [&] {
      for (uint32_t i = 0; i < s.nsurfel; ++i)
        if (marks[i]) s.x[4 * size_t{i}] += i < kPoints ? -0.05 : 0.05;
    };
    dent(s, kSquares, 99, 0.01);
    set_back();
    second.follow(first, map, marks);
    SelfList third(Memory::standard(), s);
    third.follow(second, same, Array<uint8_t>(s.nsurfel, 0));
    dent(s, kSquares, 99, 0.01);
    dent(s, kSquares, 100, 0.01);
    set_back();
    EXPECT_TRUE(second.update(0.01, 1e-3));
    EXPECT_EQ(second.parts(), 1u);
    EXPECT_EQ(second.renewals(), 1u);
    EXPECT_GT(expect_lists_all(s, second, "after the cut"), 100u);
    EXPECT_TRUE(third.update(0.01, 1e-3));
    EXPECT_GT(expect_lists_all(s, third, "after two cuts at once"), 100u);
  }
}

TEST(SelfList, RandomFolding_IsCoveredWithAndWithoutRenewal) {
  Surface s = sheet(9);
  SelfList list(Memory::standard(), s);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  const double h = 0.01, offset = 1e-3;
  int kept = 0;
  size_t needed = 0;
  for (int step = 0; step < 310; ++step) {
    const double fold = 0.01 * step, spin = 0.004 * step;
    for (uint32_t i = 0; i < s.nsurfel; ++i) {
      const double u = i % 10, bend = std::min(3.1, fold);  // rolled about y, turned about z as a whole
      const double a = bend * (u / 9 - 0.5) * 2, r = bend > 0 ? 4.5 / std::max(bend, 0.1) : 0;
      const Vec3 x{r * std::sin(a), double(i / 10), r * (1 - std::cos(a))};
      const Vec3 before = load3(&s.x[4 * size_t{i}]);
      const Vec3 now{std::cos(spin) * x.x - std::sin(spin) * x.y + 0.3 * step,
                     std::sin(spin) * x.x + std::cos(spin) * x.y, x.z + 1e-4 * unit(random)};
      store3(&s.x[4 * size_t{i}], now);
      store3(&s.v[4 * size_t{i}], step ? (1 / h) * (now - before) : Vec3{});
    }
    kept += !list.update(h, offset);
    if (step % 3 == 0) needed += expect_covers(s, list, h, offset, ("step " + std::to_string(step)).c_str());
    if (HasFailure()) break;
  }
  EXPECT_GT(needed, 100u) << "a case without pairs shows nothing";
  EXPECT_GT(kept, 100) << "nor does one in which every look renews";
}

TEST(SelfList, RigidMotion_KeepsTheLists) {
  Surface s = sheet(6);
  const Surface rest = s;
  SelfList list(Memory::standard(), s);
  for (int step = 0; step < 200; ++step) {
    const double a = 0.02 * step, omega = 20;
    for (uint32_t i = 0; i < s.nsurfel; ++i) {
      const Vec3 x = at(rest, i);
      store3(&s.x[4 * size_t{i}], {std::cos(a) * x.x - std::sin(a) * x.y + step,
                                   std::sin(a) * x.x + std::cos(a) * x.y, x.z - step});
      const Vec3 y = at(s, i);
      store3(&s.v[4 * size_t{i}], {-omega * (y.y) + 1000, omega * (y.x - step), -1000});
    }
    EXPECT_EQ(list.update(1e-3, 1e-3), step == 0) << "step " << step;
  }
}

// m: of all pairs without a common corner, the least distance beyond the reach of their contact, or the depth
// from which they are led back.
double least_beyond(const Surface &s, double h, double offset) {
  double least = HUGE_VAL;
  const auto pair = [&](double distance, std::span<const uint32_t> a, std::span<const uint32_t> b) {
    double speed = 0;
    for (const uint32_t i : a)
      for (const uint32_t j : b)
        speed = std::max(speed, norm(load3(&s.v[4 * size_t{i}]) - load3(&s.v[4 * size_t{j}])));
    least = std::min(least, distance - std::max(contact_reach(h, offset, speed), self_recovery_depth(s)));
  };
  for (uint32_t p = 0; p < s.nsurfel; ++p)
    for (uint32_t t = 0; t < s.ntri; ++t) {
      const uint32_t *c = &s.tri[3 * t];
      if (c[0] != p && c[1] != p && c[2] != p)
        pair(std::sqrt(closest_on_triangle(at(s, p), at(s, c[0]), at(s, c[1]), at(s, c[2])).distance2),
             {&p, 1}, {c, 3});
    }
  for (uint32_t e = 0; e < s.nedge; ++e)
    for (uint32_t f = e + 1; f < s.nedge; ++f) {
      const uint32_t *a = &s.edge[2 * e], *b = &s.edge[2 * f];
      if (a[0] != b[0] && a[0] != b[1] && a[1] != b[0] && a[1] != b[1])
        pair(std::sqrt(closest_segments(at(s, a[0]), at(s, a[1]), at(s, b[0]), at(s, b[1])).distance2),
             {a, 2}, {b, 2});
    }
  return least;
}

// A sheet that turns, drifts and is rolled up and unrolled: far is never said where a pair is within reach,
// whatever is kept from the last look, and is said where all are well apart.
// unsanitized: too slow there; shorter tests run the same code
TEST(SelfList, SheetThatRollsUpAndUnrolls_IsFarOnlyWhereNoPairIsWithinReach) {
  constexpr uint32_t kSquares = 6;
  Surface s = sheet(kSquares);
  SelfList list(Memory::standard(), s);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-1, 1);
  const double h = 1e-3, offset = 0.01;
  uint32_t far_ones = 0, clear_ones = 0, near_ones = 0;
  const Array<double> flat = s.x;
  for (int step = 0; step < 400; ++step) {
    const double bend = 1.25 * std::sin(0.015 * step), turn = 0.03 * step;  // 1/m; rad
    for (uint32_t i = 0; i < s.nsurfel; ++i) {
      const Vec3 x = load3(&flat[4 * size_t{i}]);
      const double angle = bend * x.x, r = std::fabs(bend) > 1e-6 ? 1 / bend : 0;
      const Vec3 rolled{r != 0 ? r * std::sin(angle) : x.x, x.y + 0.1 * step + 0.003 * bend * u(random),
                        r != 0 ? r * (1 - std::cos(angle)) : 0};
      store3(&s.x[4 * size_t{i}], {std::cos(turn) * rolled.x - std::sin(turn) * rolled.y,
                                   std::sin(turn) * rolled.x + std::cos(turn) * rolled.y, rolled.z});
      store3(&s.v[4 * size_t{i}], {30 * std::sin(0.2 * step) + u(random), 4 * u(random), u(random)});
    }
    const bool far = list.far(h, offset, step % 3 == 0 ? HUGE_VAL : largest_speed(s));
    const double beyond = least_beyond(s, h, offset);
    if (far) {
      ASSERT_GT(beyond, 0) << "step " << step;
    }
    far_ones += far;
    clear_ones += beyond > 0.45;
    near_ones += !(beyond > 0);
  }
  EXPECT_GT(far_ones, 0.8 * clear_ones) << "of the looks at which all pairs are well apart";
  EXPECT_GT(clear_ones, 20u);
  EXPECT_GT(near_ones, 20u);
  EXPECT_LT(list.renewals(), 390u) << "most looks need no new list";
}

// Speeds that an impact has changed, beyond what there was before the solve.
TEST(SelfList, ImpactThatFoldsWithinTheSubStep_DoesNotStayFar) {
  Surface s = sheet(6);
  SelfList list(Memory::standard(), s);
  for (const double change : {0.0, 10.0, 1000.0}) {
    ASSERT_TRUE(list.far(1e-3, 0.01, 0));
    EXPECT_EQ(list.stays_far(1e-3, 0.01, change), change < 500) << change << " m/s";
  }
}

}  // namespace dfm
