// Whether a surface may touch itself, against the definition of it applied to every pair.
#include "broad/self_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "body/make_surface.h"
#include "contact/reach.h"
#include "geometry/closest.h"

namespace dfm {
namespace {

constexpr uint32_t kWidth = 6;
constexpr double kOffset = 0.01;

Surface sheet() {
  std::vector<double> points;
  std::vector<uint32_t> tris;
  for (uint32_t j = 0; j <= kWidth; ++j)
    for (uint32_t i = 0; i <= kWidth; ++i) points.insert(points.end(), {double(i), double(j), 0});
  for (uint32_t j = 0; j < kWidth; ++j)
    for (uint32_t i = 0; i < kWidth; ++i) {
      const uint32_t a = j * (kWidth + 1) + i, b = a + 1, c = a + kWidth + 1, d = c + 1;
      tris.insert(tris.end(), {a, b, d, a, d, c});
    }
  Surface s;
  make_surface(Memory::standard(), uint32_t(points.size() / 3), points.data(), tris.data(),
               uint32_t(tris.size() / 3), s);
  return s;
}

// The definition, of every surfel and triangle and of every two edges.
bool near(const Surface &s, const SelfRest &rest, double h) {
  const double recovery = self_recovery_depth(s);
  const auto is_near = [&](double at_rest, double distance, double speed) {
    const double most = 0.6 * at_rest;
    return distance < std::max(std::min(2 * kOffset, most) + 2 * h * speed, std::min(recovery, most));
  };
  const auto at = [&](const double *x, uint32_t i) { return load3(x + 4 * size_t{i}); };
  const auto speed = [&](std::initializer_list<uint32_t> a, std::initializer_list<uint32_t> b) {
    double most = 0;
    for (const uint32_t i : a)
      for (const uint32_t j : b) most = std::max(most, norm(at(s.v.data(), i) - at(s.v.data(), j)));
    return most;
  };
  const auto face = [&](const double *x, uint32_t p, const uint32_t *c) {
    return std::sqrt(closest_on_triangle(at(x, p), at(x, c[0]), at(x, c[1]), at(x, c[2])).distance2);
  };
  for (uint32_t p = 0; p < s.nsurfel; ++p)
    for (uint32_t t = 0; t < s.ntri; ++t) {
      const uint32_t *const c = &s.tri[3 * size_t{t}];
      if (c[0] == p || c[1] == p || c[2] == p) continue;
      if (is_near(face(rest.x.data(), p, c), face(s.x.data(), p, c), speed({p}, {c[0], c[1], c[2]})))
        return true;
    }
  const auto edge = [&](const double *x, const uint32_t *a, const uint32_t *b) {
    return std::sqrt(closest_segments(at(x, a[0]), at(x, a[1]), at(x, b[0]), at(x, b[1])).distance2);
  };
  for (uint32_t e = 0; e < s.nedge; ++e)
    for (uint32_t f = e + 1; f < s.nedge; ++f) {
      const uint32_t *const a = &s.edge[2 * size_t{e}], *const b = &s.edge[2 * size_t{f}];
      if (a[0] == b[0] || a[0] == b[1] || a[1] == b[0] || a[1] == b[1]) continue;
      if (is_near(edge(rest.x.data(), a, b), edge(s.x.data(), a, b), speed({a[0], a[1]}, {b[0], b[1]})))
        return true;
    }
  return false;
}

struct Watched {
  Surface s = sheet();
  SelfRest rest;
  SelfList list{Memory::standard(), s};
  SelfWatch watch{Memory::standard(), s, rest, list};
  Watched() {
    rest.x = s.x;
    list.set_wide(true);
  }
};

}  // namespace

// A sheet that turns, drifts and is rolled up and unrolled: the answer is that of the definition at every
// look, whatever the watch keeps from the last.
TEST(SelfWatch, SheetThatRollsUpAndUnrolls_IsNearWhereAnyPairIs) {
  Watched watched;
  auto &[s, rest, list, watch] = watched;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-1, 1);
  const double h = 1e-3;
  uint32_t near_ones = 0, changes = 0;
  bool last = false;
  const Array<double> flat = s.x;
  for (int step = 0; step < 400; ++step) {
    const double bend = 1.25 * std::sin(0.015 * step), turn = 0.03 * step;  // 1/m; rad
    for (uint32_t i = 0; i < s.nsurfel; ++i) {
      const Vec3 at = load3(&flat[4 * size_t{i}]);
      const double angle = bend * at.x, r = std::fabs(bend) > 1e-6 ? 1 / bend : 0;
      const Vec3 rolled{r != 0 ? r * std::sin(angle) : at.x, at.y + 0.1 * step + 0.003 * bend * u(random),
                        r != 0 ? r * (1 - std::cos(angle)) : 0};
      const Vec3 turned{std::cos(turn) * rolled.x - std::sin(turn) * rolled.y,
                        std::sin(turn) * rolled.x + std::cos(turn) * rolled.y, rolled.z};
      store3(&s.x[4 * size_t{i}], turned);
      store3(&s.v[4 * size_t{i}], Vec3{30 * std::sin(0.2 * step) + u(random), 4 * u(random), u(random)});
    }
    const double speed = step % 3 == 0 ? HUGE_VAL : largest_speed(s);
    const bool now = watch.near(h, kOffset, speed);
    ASSERT_EQ(now, near(s, rest, h)) << "step " << step;
    near_ones += now;
    changes += now != last;
    last = now;
  }
  EXPECT_GE(changes, 2u);
  EXPECT_GT(near_ones, 20u);
  EXPECT_LT(near_ones, 380u);
  EXPECT_LT(list.renewals(), 390u) << "most looks need no new list";
}

// Speeds that an impact has changed, beyond what there was before the solve.
TEST(SelfWatch, ImpactThatFoldsWithinTheSubStep_IsMet) {
  Watched watched;
  auto &[s, rest, list, watch] = watched;
  const uint32_t thrown = 0;
  const double h = 1e-3;
  for (const double speed : {0.0, 500.0, 990.0, 2000.0}) {
    ASSERT_FALSE(watch.near(h, kOffset, 0));
    // toward a triangle that is one edge away
    const auto velocity = [&](uint32_t i) { return i == thrown ? Vec3{speed, 0, 0} : Vec3{}; };
    EXPECT_EQ(watch.meets(h, kOffset, speed, velocity), speed > 700) << speed << " m/s";
  }
}

}  // namespace dfm
