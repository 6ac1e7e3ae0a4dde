// Lists of a surface against itself: what they must hold, and that they hold it through motion.
#include "broad/self_list.h"

#include <gtest/gtest.h>

#include <algorithm>
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

}  // namespace

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

}  // namespace dfm
