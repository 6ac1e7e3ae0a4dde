// Rays and closest points against closed forms, surface arrays, impulses, measures.
#include <algorithm>
#include <map>

#include "obstacle.h"
#include "query.h"
#include "stack.h"
#include "vec.h"

namespace {

using test::cross;
using test::dot;
using test::Vec;

Vec operator-(Vec a, Vec b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

struct Hit {
  double distance;
  Vec point, normal;
  dfm_query_hit raw;
};

Hit hit_of(const dfm_query_hit &h) {
  return {h.distance, {h.point[0], h.point[1], h.point[2]}, {h.normal[0], h.normal[1], h.normal[2]}, h};
}

Hit ray(dfm_world w, Vec o, Vec d, double most = 100) { return hit_of(test::ray(w, o, d, most)); }

void expect(const Hit &h, double distance, Vec point, Vec normal, const char *what) {
  EXPECT_NEAR(h.distance, distance, 1e-12) << what;
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(h.point[k], point[k], 1e-12) << what;
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(h.normal[k], normal[k], 1e-12) << what;
}

void expect_nothing(const Hit &h, const char *what) {
  EXPECT_TRUE(h.raw.thing == 0 && std::isinf(h.distance)) << what;
}

dfm_obstacle add(dfm_world w, uint32_t shape, Vec at, std::array<double, 4> q = {0, 0, 0, 1}) {
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.shape = shape;
  d.radius = 0.2;
  d.half_length = 0.5;
  d.half_size[0] = 0.1;
  d.half_size[1] = 0.2;
  d.half_size[2] = 0.3;
  for (size_t k = 0; k < 3; ++k) d.pose.position[k] = at[k];
  for (size_t k = 0; k < 4; ++k) d.pose.rotation[k] = q[k];
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w, &d, &o));
  return o;
}

const double s2 = std::sqrt(0.5);
const std::array<double, 4> kQuarterX{s2, 0, 0, s2};  // local z to -y, local y to z

}  // namespace

TEST(Ray, MeetsThePlaneFromBothSides) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  const dfm_obstacle o = add(w, DFM_SHAPE_PLANE, {0, 0, 1});
  expect(ray(w, {3, 4, 5}, {0, 0, -7}), 4, {3, 4, 1}, {0, 0, 1},
         "from above; the direction need not be unit");
  expect(ray(w, {0, 0, 0}, {0, 3, 4}), 1.25, {0, 0.75, 1}, {0, 0, 1}, "from below");
  expect_nothing(ray(w, {0, 0, 5}, {1, 0, 0}), "along it");
  expect_nothing(ray(w, {0, 0, 5}, {0, 0, 1}), "away from it");
  expect_nothing(ray(w, {3, 4, 5}, {0, 0, -1}, 3.99), "beyond max_distance");
  EXPECT_EQ(ray(w, {3, 4, 5}, {0, 0, -1}).raw.thing, o);
}

TEST(Ray, MeetsTheSphereFromOutsideAndInside) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  add(w, DFM_SHAPE_SPHERE, {1, 2, 3});
  expect(ray(w, {1, 2, 10}, {0, 0, -1}), 6.8, {1, 2, 3.2}, {0, 0, 1}, "top");
  expect(ray(w, {-1, 2.12, 3}, {1, 0, 0}), 2 - 0.16, {0.84, 2.12, 3}, {-0.8, 0.6, 0}, "off center");
  expect(ray(w, {1, 2, 3}, {0, 1, 0}), 0.2, {1, 2.2, 3}, {0, 1, 0}, "from inside");
  expect_nothing(ray(w, {-1, 2.21, 3}, {1, 0, 0}), "past it");
  expect_nothing(ray(w, {1, 2, 2}, {0, 0, -1}), "behind");
}

TEST(Ray, MeetsTheTurnedBoxFromOutsideAndInside) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  add(w, DFM_SHAPE_BOX, {0, 0, 0}, kQuarterX);  // half sizes in the world: x 0.1, y 0.3, z 0.2
  expect(ray(w, {0.05, -2, 0.1}, {0, 1, 0}), 1.7, {0.05, -0.3, 0.1}, {0, -1, 0}, "face -y");
  expect(ray(w, {0.05, 0.1, 2}, {0, 0, -1}), 1.8, {0.05, 0.1, 0.2}, {0, 0, 1}, "face z");
  expect(ray(w, {0.02, 0.1, 0.1}, {1, 0, 0}), 0.08, {0.1, 0.1, 0.1}, {1, 0, 0}, "from inside");
  expect_nothing(ray(w, {0.11, -2, 0}, {0, 1, 0}), "past it");
  expect_nothing(ray(w, {0, 2, 0}, {0, 1, 0}), "behind");
}

TEST(Ray, MeetsTheCapsulesSideAndCapsFromOutsideAndInside) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  add(w, DFM_SHAPE_CAPSULE, {0, 0, 0});
  expect(ray(w, {2, 0.12, 0.4}, {-1, 0, 0}), 1.84, {0.16, 0.12, 0.4}, {0.8, 0.6, 0}, "side");
  expect(ray(w, {0, 0, 3}, {0, 0, -1}), 2.3, {0, 0, 0.7}, {0, 0, 1}, "cap, along the axis");
  expect(ray(w, {0.12, 0, -3}, {0, 0, 1}), 3 - 0.66, {0.12, 0, -0.66}, {0.6, 0, -0.8}, "cap, off the axis");
  expect(ray(w, {0, 0, 0}, {0, 0, 1}), 0.7, {0, 0, 0.7}, {0, 0, 1}, "from inside along the axis");
  expect(ray(w, {0, 0, 0.45}, {1, 0, 0}), 0.2, {0.2, 0, 0.45}, {1, 0, 0},
         "from inside, where a cap's sphere lies deeper");
  expect_nothing(ray(w, {2, 0.21, 0}, {-1, 0, 0}), "past it");
  expect_nothing(ray(w, {2, 0, 0.71}, {-1, 0, 0}), "over it");
}

TEST(Ray, MeetsBodiesByTriangleAndTheNearestThingWins) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  const Hit top = ray(s.world, {0.06, 0.05, 5}, {0, 0, -1});
  EXPECT_EQ(top.raw.thing, s.upper);
  expect(top, 5 - 0.2003, {0.06, 0.05, 0.2003}, {0, 0, 1}, "top face");
  dfm_body_info info{};
  test::ok(dfm_body_get_info(s.upper, &info));
  EXPECT_LT(top.raw.triangle, info.ntriangle);
  expect(ray(s.world, {-1, 0.05, 0.05}, {1, 0, 0}), 1, {0, 0.05, 0.05}, {-1, 0, 0}, "side of the lower cube");
  EXPECT_EQ(ray(s.world, {-1, 0.05, 0.05}, {1, 0, -0.2}).raw.thing, s.floor);
  expect_nothing(ray(s.world, {-1, 0.05, 5}, {1, 0, 0}), "over all");
}

TEST(Ray, FromInsideOfTriangles_MeetsWhereItLeavesThem) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  test::BodyOptions o;
  o.name = "cube";
  o.position = {1, 1, 1};
  const dfm_body body = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  const Hit out = ray(w, {1.04, 1.03, 1.02}, {0, 0, 1});
  expect(out, 0.08, {1.04, 1.03, 1.1}, {0, 0, 1}, "a body's face, from behind");
  EXPECT_EQ(out.raw.thing, body);
  const test::Triangles box = test::box_surface({0.1, 0.2, 0.3}, 4);
  for (const uint32_t shape : {uint32_t(DFM_SHAPE_MESH), uint32_t(DFM_SHAPE_VOXELS)}) {
    dfm_obstacle_def d = test::mesh_def(shape == DFM_SHAPE_MESH ? "mesh" : "voxels", box, shape, 8000);
    d.pose.position[0] = shape == DFM_SHAPE_MESH ? 5 : 8;
    for (size_t k = 0; k < 4; ++k) d.pose.rotation[k] = kQuarterX[k];  // half sizes: x 0.1, y 0.3, z 0.2
    dfm_obstacle ob = 0;
    test::ok(dfm_obstacle_create(w, &d, &ob));
    const double x = d.pose.position[0];
    const Hit inside = ray(w, {x + 0.03, 0.04, 0.05}, {0, 1, 0});
    expect(inside, 0.26, {x + 0.03, 0.3, 0.05}, {0, 1, 0}, d.name);
    EXPECT_EQ(inside.raw.thing, ob);
    expect(ray(w, {x + 0.03, 0.04, 2}, {0, 0, -1}), 1.8, {x + 0.03, 0.04, 0.2}, {0, 0, 1}, "from outside");
    expect_nothing(ray(w, {x + 0.11, 0.04, 2}, {0, 0, -1}, 5), "past it");
  }
}

TEST(Ray, InThePlaneOfAFace_MeetsTheFaceAcrossItsWay) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  test::BodyOptions o;
  o.name = "cube";
  test::make_body(c, w, "beam", {0.5, 0.5, 0.5}, 60, o);
  expect(ray(w, {-1, 0.25, 0.5}, {1, 0, 0}), 1, {0, 0.25, 0.5}, {-1, 0, 0}, "along the upper face");
  expect(ray(w, {-1, 0, 0}, {1, 0, 0}), 1, {0, 0, 0}, {-1, 0, 0}, "along an edge");
  expect_nothing(ray(w, {-1, 0.25, 0.5000001}, {1, 0, 0}), "just above it");
}

TEST(Ray, OfAnyScale_MeetsTheSamePoint) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  const Hit near = ray(s.world, {0.06, 0.05, 5}, {0, 0, -1});
  EXPECT_EQ(ray(s.world, {0.06, 0.05, 5}, {0, 0, -1e-100}).distance, near.distance) << "a short direction";
  EXPECT_EQ(ray(s.world, {0.06, 0.05, 5}, {0, 0, -1}, INFINITY).distance, near.distance);
  EXPECT_EQ(ray(s.world, {0.06, 0.05, 5}, {0, 0, -1}, near.distance).raw.thing, s.upper)
      << "up to and with it";
  EXPECT_EQ(ray(s.world, {0.06, 0.05, 1e6}, {0, 0, -1}, INFINITY).raw.thing, s.upper) << "from far away";
  expect_nothing(ray(s.world, {1e6, 0.05, 5}, {1, 0, 1e-320}, INFINITY), "away, almost along an axis");
  EXPECT_EQ(test::nearest(s.world, test::point({0.06, 0.05, 1e6}), nullptr, INFINITY).thing, s.upper);
}

TEST(Closest, PointOfABody_OnFaceEdgeAndCorner) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  test::BodyOptions o;
  o.name = "cube";
  o.position = {1, 1, 1};
  const dfm_body b = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  auto closest = [&](Vec p, double most) { return hit_of(test::nearest(w, test::point(p), nullptr, most)); };
  expect(closest({1.04, 1.03, 1.5}, 10), 0.4, {1.04, 1.03, 1.1}, {0, 0, 1}, "face");
  EXPECT_NEAR(closest({1.03, 0.97, 1.14}, 10).distance, 0.05, 1e-12) << "edge";
  EXPECT_NEAR(closest({0.98, 0.97, 0.94}, 10).distance, 0.07, 1e-12) << "corner";
  EXPECT_NEAR(closest({1.05, 1.05, 1.03}, 10).distance, 0.03, 1e-12) << "from inside";
  EXPECT_EQ(closest({1.04, 1.03, 1.5}, 10).raw.thing, b);
  expect_nothing(closest({1.04, 1.03, 1.5}, 0.39), "too far");
}

TEST(Surface, OfEveryGenerator_IsClosedOutwardAndHasTheVolumeOfItsCells) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  const struct {
    const char *kind;
    Vec size;
  } shapes[] = {{"ball", {0.1, 0, 0}}, {"beam", {0.1, 0.2, 0.3}}, {"cylinder", {0.1, 0.4, 0}}};
  for (const auto &shape : shapes) {
    test::BodyOptions o;
    o.position = {0.3, -0.2, 0.5};
    o.rotation = {0.1, 0.2, 0.3, 0.9};
    const dfm_body b = test::make_body(c, w, shape.kind, shape.size, 300, o);
    dfm_body_info info{};
    test::ok(dfm_body_get_info(b, &info));
    uint32_t n = 0;
    std::vector<double> x(3 * info.nsurfel), normal(x.size()), state(3 * info.npoint);
    std::vector<uint32_t> tri(3 * info.ntriangle), point(info.nsurfel);
    test::ok(dfm_surface_positions(b, info.nsurfel, x.data(), &n));
    EXPECT_EQ(n, info.nsurfel);
    test::ok(dfm_surface_normals(b, info.nsurfel, normal.data(), &n));
    test::ok(dfm_surface_triangles(b, info.ntriangle, tri.data(), &n));
    EXPECT_EQ(n, info.ntriangle);
    test::ok(dfm_surface_points(b, info.nsurfel, point.data(), &n));
    test::ok(dfm_body_get_state(b, info.npoint, state.data(), nullptr, &n));
    for (uint32_t s = 0; s < info.nsurfel; ++s)
      for (size_t k = 0; k < 3; ++k) ASSERT_EQ(x[3 * s + k], state[3 * point[s] + k]);
    auto at = [&](uint32_t s) { return Vec{x[3 * s], x[3 * s + 1], x[3 * s + 2]}; };
    // Gauss: the volume inside is a sum over outward triangles; every edge is met once in each direction
    double volume = 0;
    std::map<std::pair<uint32_t, uint32_t>, int> edges;
    for (uint32_t t = 0; t < info.ntriangle; ++t) {
      const uint32_t *const k = &tri[3 * t];
      volume += dot(at(k[0]), cross(at(k[1]), at(k[2]))) / 6;
      for (int e = 0; e < 3; ++e) ++edges[{k[e], k[(e + 1) % 3]}];
    }
    EXPECT_NEAR(volume, info.rest_volume, 1e-12) << shape.kind;
    for (const auto &[edge, count] : edges) {
      ASSERT_EQ(count, 1);
      const std::pair<uint32_t, uint32_t> back{edge.second, edge.first};
      ASSERT_EQ(edges.count(back), 1u) << shape.kind << ": the surface is open";
    }
    const dfm_body_measure m = test::measure(b);
    EXPECT_NEAR(m.volume, info.rest_volume, 1e-12);
    EXPECT_NEAR(m.mass, 1000 * info.rest_volume, 1e-9);
    for (uint32_t s = 0; s < info.nsurfel; ++s) {
      const Vec v{normal[3 * s], normal[3 * s + 1], normal[3 * s + 2]};
      EXPECT_NEAR(dot(v, v), 1, 1e-12);
      EXPECT_GT(dot(v, at(s) - Vec{m.com[0], m.com[1], m.com[2]}), 0)
          << shape.kind << ": these shapes are convex, so normals point away";
    }
    uint32_t small = 0;
    double canary[3] = {7, 7, 7};
    EXPECT_EQ(dfm_surface_positions(b, 1, canary, &small), DFM_E_ARG);
    EXPECT_EQ(small, info.nsurfel);
    EXPECT_EQ(canary[0], 7);
  }
}

TEST(Impulse, AtAPoint_ChangesMomentumAndSpinByExactlyThat) {
  test::Context c;
  const dfm_world w = test::make_world(c, {0, 0, 0});
  test::BodyOptions o;
  o.velocity = {1, 2, 3};
  o.spin = {4, 5, 6};
  const dfm_body b = test::make_body(c, w, "beam", {0.1, 0.2, 0.3}, 200, o);
  const dfm_body_measure before = test::measure(b);
  const Vec point{0.033, 0.117, 0.3}, impulse{0.3, -0.2, 0.5};  // on the top face
  test::ok(dfm_body_apply_impulse(b, point.data(), impulse.data()));
  const dfm_body_measure after = test::measure(b);
  const Vec spin = cross(point - Vec{before.com[0], before.com[1], before.com[2]}, impulse);
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(after.momentum[k] - before.momentum[k], impulse[k],
                1e-12 * (1 + std::fabs(before.momentum[k])));
    EXPECT_NEAR(after.angular[k] - before.angular[k], spin[k], 1e-12);
    EXPECT_EQ(after.com[k], before.com[k]);
  }
}

TEST(Measure, OfARigidlyMovingBody_IsThatOfItsPointMasses) {
  test::Context c;
  const dfm_world w = test::make_world(c, {0, 0, 0});
  test::BodyOptions o;
  o.position = {1, 2, 3};
  o.velocity = {0.5, -0.25, 1};
  o.spin = {0, 0, 8};
  o.density = 800;
  const dfm_body b = test::make_body(c, w, "beam", {0.1, 0.2, 0.3}, 400, o);
  const dfm_body_measure m = test::measure(b);
  EXPECT_NEAR(m.mass, 800 * 0.006, 1e-12);
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(m.velocity[k], o.velocity[k], 1e-12);
    EXPECT_NEAR(m.momentum[k], m.mass * o.velocity[k], 1e-12);
  }
  EXPECT_NEAR(m.com[2], 3.15, 5e-3);
  EXPECT_EQ(m.inverted, 0u);
  EXPECT_NEAR(m.elastic, 0, 1e-12);
  EXPECT_NEAR(m.kinetic, 0.5 * m.mass * (0.25 + 0.0625 + 1) + 0.5 * m.angular[2] * 8, 1e-9)
      << "translation and spin apart";
  // lumped masses sit on the corners of cells, so the inertia is above that of the solid
  const double solid = m.mass / 12 * (0.01 + 0.04);
  EXPECT_GT(m.angular[2] / 8, solid);
  EXPECT_LT(m.angular[2] / 8, 1.6 * solid);
  EXPECT_GE(m.speed_max, std::sqrt(m.velocity[0] * m.velocity[0] + m.velocity[1] * m.velocity[1] +
                                   m.velocity[2] * m.velocity[2]));
}
