// Splitting of long edges: shape, places of the given points, groups, closedness.
#include "scene/split.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "math/vec3.h"

namespace {

using dfm::Vec3;
using dfm::scene::Triangles;

// A box with two triangles to a side; the group of a triangle is its side.
Triangles box(double x, double y, double z) {
  Triangles s;
  for (int i = 0; i < 8; ++i) s.points.insert(s.points.end(), {i & 4 ? x : 0, i & 2 ? y : 0, i & 1 ? z : 0});
  s.triangles = {0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1,
                 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3};
  for (uint32_t side = 0; side < 6; ++side) s.group.insert(s.group.end(), {side, side});
  return s;
}

Vec3 at(const Triangles &s, size_t t, size_t k) {
  return dfm::load3(&s.points[3 * size_t{s.triangles[3 * t + k]}]);
}

std::map<uint32_t, double> area_by_group(const Triangles &s) {
  std::map<uint32_t, double> out;
  for (size_t t = 0; 3 * t < s.triangles.size(); ++t)
    out[s.group[t]] += 0.5 * norm(cross(at(s, t, 1) - at(s, t, 0), at(s, t, 2) - at(s, t, 0)));
  return out;
}

double volume(const Triangles &s) {
  double sum = 0;
  for (size_t t = 0; 3 * t < s.triangles.size(); ++t)
    sum += dot(at(s, t, 0), cross(at(s, t, 1), at(s, t, 2))) / 6;
  return sum;
}

}  // namespace

// Sizes at which triangles have one, two and three long edges in turn.
TEST(SplitLongEdges, ABox_StaysTheSameShape) {
  for (const double longest : {0.9, 0.4, 0.15, 0.051}) {
    SCOPED_TRACE(longest);
    const Triangles before = box(1, 0.3, 0.05);
    Triangles s = before;
    dfm::scene::split_long_edges(longest, s);
    ASSERT_EQ(s.group.size() * 3, s.triangles.size());
    ASSERT_GT(s.triangles.size(), before.triangles.size());
    for (size_t i = 0; i < before.points.size(); ++i) ASSERT_EQ(s.points[i], before.points[i]);
    std::map<std::pair<uint32_t, uint32_t>, int> sides;
    for (size_t t = 0; 3 * t < s.triangles.size(); ++t)
      for (size_t k = 0; k < 3; ++k) {
        ++sides[{s.triangles[3 * t + k], s.triangles[3 * t + (k + 1) % 3]}];
        ASSERT_LE(norm(at(s, t, k) - at(s, t, (k + 1) % 3)), longest * (1 + 1e-12));
      }
    for (const auto &[edge, count] : sides) {
      ASSERT_EQ(count, 1);
      ASSERT_TRUE(sides.count({edge.second, edge.first}));
    }
    EXPECT_NEAR(volume(s), volume(before), 1e-15);
    const auto now = area_by_group(s), then = area_by_group(before);
    ASSERT_EQ(now.size(), then.size());
    for (const auto &[group, area] : then) EXPECT_NEAR(now.at(group), area, 1e-13);
  }
}

TEST(SplitLongEdges, ShortEdges_StayAsTheyAre) {
  Triangles s = box(1, 1, 1);
  s.group.clear();
  dfm::scene::split_long_edges(2, s);
  EXPECT_EQ(s.points.size(), 24u);
  EXPECT_EQ(s.triangles.size(), 36u);
  EXPECT_TRUE(s.group.empty());
}
