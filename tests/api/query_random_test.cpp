// Random shapes, from a point to a thousand meters and from slivers to cubes, in a world of everything:
// answers of different queries agree with each other, and those of the functions in deform/deprecated.h.
#include <algorithm>
#include <random>

#include "obstacle.h"
#include "query.h"
#include "rigid.h"
#include "stack.h"

namespace {

class Random {
 public:
  double number(double lo, double hi) { return lo + (hi - lo) * (double(engine_()) / 4294967296.0); }
  // Mostly of the order of the scene, sometimes nothing, tiny or huge.
  double size() {
    const uint32_t kind = engine_() % 10;
    return kind == 0 ? 0 : kind == 1 ? 1e-200 : kind == 2 ? std::pow(10, number(-9, 3)) : number(0.001, 0.3);
  }
  uint32_t below(uint32_t n) { return uint32_t(engine_() % n); }

 private:
  std::mt19937 engine_{11};
};

struct Everything {
  test::Stack s;
  explicit Everything(dfm_context *c) : s(test::make_stack(c)) {
    const test::Triangles cube = test::box_surface({0.1, 0.1, 0.1}, 2);
    const test::Triangles hill = test::height_field(0.3, 4, [](double x, double y) { return 0.3 * x * y; });
    for (uint32_t shape = DFM_SHAPE_SPHERE; shape <= DFM_SHAPE_VOXELS; ++shape) {
      dfm_obstacle_def d = dfm_obstacle_def_default();
      d.shape = shape;
      d.radius = 0.1;
      d.half_length = 0.1;
      d.half_size[0] = 0.2;
      d.half_size[1] = 0.05;
      d.half_size[2] = 0.1;
      const bool open = shape == DFM_SHAPE_MESH;
      const test::Triangles &m = open ? hill : cube;
      if (shape >= DFM_SHAPE_MESH) {
        d.npoint = uint32_t(m.points.size() / 3);
        d.points = m.points.data();
        d.ntriangle = uint32_t(m.tris.size() / 3);
        d.triangles = m.tris.data();
      }
      d.pose.position[0] = 0.5 * shape - 1.2;
      d.pose.position[2] = 0.4;
      d.pose.rotation[0] = 0.3;
      d.pose.rotation[1] = 0.1 * shape;
      d.pose.rotation[3] = 0.9;
      dfm_obstacle o = 0;
      test::ok(dfm_obstacle_create(s.world, &d, &o));
    }
    test::create(s.world, {test::box("plate", {0.1, 0.1, 0.02}, 1, {0.1, 0.6, 0.2})});
  }
};

dfm_query_shape any_shape(Random &r, std::vector<double> &points) {
  dfm_query_shape s = dfm_query_shape_default();
  const uint32_t kinds[] = {DFM_SHAPE_SPHERE, DFM_SHAPE_BOX, DFM_SHAPE_CAPSULE, DFM_SHAPE_CONVEX};
  s.shape = kinds[r.below(4)];
  for (double &x : s.pose.position) x = r.number(-1.5, 1.5);
  if (r.below(20) == 0) s.pose.position[r.below(3)] = 1e4;
  for (double &q : s.pose.rotation) q = r.number(-1, 1);
  s.radius = s.shape == DFM_SHAPE_BOX && r.below(2) ? 0 : r.size();
  s.half_length = r.size();
  for (double &h : s.half_size) h = r.size();
  points.clear();
  const uint32_t n = 1 + r.below(6);
  const double size = r.size();
  for (uint32_t i = 0; i < 3 * n; ++i) points.push_back(r.below(4) ? size * r.number(-1, 1) : 0);
  s.npoint = n;
  s.points = points.data();
  return s;
}

}  // namespace

TEST(QueryRandom, FunctionsAgreeWithEachOther) {
  test::Context c;
  const Everything e(c);
  const dfm_world w = e.s.world;
  Random r;
  std::vector<double> points;
  int hits = 0, insides = 0;
  for (int i = 0; i < 3000; ++i) {
    SCOPED_TRACE(i);
    const dfm_query_shape s = any_shape(r, points);
    uint64_t things[16];
    uint32_t n = 0;
    ASSERT_EQ(dfm_world_query_overlap(w, &s, nullptr, 16, things, &n), DFM_OK) << dfm_last_error();
    ASSERT_LE(n, 9u);
    dfm_query_hit hit{};
    const double path[3] = {r.number(-2, 2), r.number(-2, 2), r.number(-2, 2)}, none[3] = {0, 0, 0};
    // a path of no length meets what overlaps
    ASSERT_EQ(dfm_world_query_cast(w, &s, none, nullptr, &hit), DFM_OK);
    ASSERT_EQ(hit.thing, n ? things[0] : 0);
    ASSERT_EQ(dfm_world_query_cast(w, &s, path, nullptr, &hit), DFM_OK) << dfm_last_error();
    if (n) {
      ASSERT_EQ(hit.distance, 0);
      ASSERT_EQ(hit.flags, uint32_t{DFM_QUERY_INSIDE});
      ++insides;
    } else if (hit.thing) {
      ++hits;
      ASSERT_GT(hit.distance, 0);
      ASSERT_EQ(hit.flags, 0u);
      double length = 0, normal = 0, along = 0;
      for (size_t k = 0; k < 3; ++k) {
        length += path[k] * path[k];
        normal += hit.normal[k] * hit.normal[k];
        along += hit.normal[k] * path[k];
        ASSERT_TRUE(std::isfinite(hit.point[k]));
      }
      length = std::sqrt(length);
      ASSERT_LE(hit.distance, length * (1 + 1e-12));
      ASSERT_NEAR(normal, 1, 1e-9);
      ASSERT_LT(along, 1e-6 * length) << "the normal looks against the path";
      // short of the hit the path is free
      double part[3];
      for (size_t k = 0; k < 3; ++k) part[k] = path[k] / length * hit.distance * 0.999;
      dfm_query_hit before{};
      ASSERT_EQ(dfm_world_query_cast(w, &s, part, nullptr, &before), DFM_OK);
      ASSERT_EQ(before.thing, 0u);
    }
    // a shape that is wider by its gap just touches the nearest thing
    const dfm_query_hit gap = test::nearest(w, s, nullptr, INFINITY);
    ASSERT_EQ(gap.distance == 0, n > 0);
    if (gap.distance > 1e-6) {
      dfm_query_shape wide = s;
      wide.radius += 0.999 * gap.distance;
      ASSERT_TRUE(test::query(w, wide).empty());
      wide.radius = s.radius + 1.001 * gap.distance;
      ASSERT_EQ(test::nearest(w, wide, nullptr, 0).distance, 0);
    }
    // a point of the largest overlapping ball
    dfm_query_hit near{}, first{}, all[64];
    ASSERT_EQ(dfm_world_query_closest(w, s.pose.position, 1e6, nullptr, &near), DFM_OK);
    ASSERT_NE(near.thing, 0u);
    dfm_query_shape ball = dfm_query_shape_default();
    std::copy(s.pose.position, s.pose.position + 3, ball.pose.position);
    ball.radius = near.distance * (1 + 1e-9) + 1e-12;
    ASSERT_EQ(dfm_world_query_overlap(w, &ball, nullptr, 16, things, &n), DFM_OK);
    ASSERT_NE(std::find(things, things + n, near.thing), things + n);
    ASSERT_EQ(dfm_world_query_ray(w, s.pose.position, path, 1e3, nullptr, &first), DFM_OK);
    ASSERT_EQ(dfm_world_query_ray_all(w, s.pose.position, path, 1e3, nullptr, 64, all, &n), DFM_OK);
    ASSERT_EQ(first.thing != 0, n > 0);
    if (n) {
      ASSERT_EQ(all[0].distance, first.distance);
    }
    for (uint32_t k = 1; k < std::min(n, 64u); ++k) ASSERT_GE(all[k].distance, all[k - 1].distance);
  }
  EXPECT_GT(hits, 300);
  EXPECT_GT(insides, 300);
}
