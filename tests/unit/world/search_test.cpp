// Rays and closest points through trees of boxes against a look at every triangle: the same answer bit for
// bit, and few triangles looked at.
#include <atomic>
#include <functional>
#include <random>
#include <thread>

#include "../narrow/detect_scene.h"
#include "core/handle.h"
#include "obstacle.h"
#include "stack.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "world/find.h"
#include "world/queries.h"

namespace {

using dfm::kFar;
using dfm::kNone;
using dfm::Vec3;

// Of a tree: as first_on_ray() and closest_to() would answer without it.
dfm::TriangleOnRay every_triangle(const dfm::Triangles &m, Vec3 o, Vec3 d, double limit) {
  dfm::TriangleOnRay best;
  for (uint32_t t = 0; t < m.corners.size() / 3; ++t) {
    const double at = dfm::ray_triangle({o, d}, m.corner(t, 0), m.corner(t, 1), m.corner(t, 2));
    if (at <= limit && at < best.distance) best = {at, t};
  }
  return best;
}
dfm::TriangleNearPoint every_triangle(const dfm::Triangles &m, Vec3 p, dfm::DistanceKey key, double limit) {
  dfm::TriangleNearPoint best;
  for (uint32_t t = 0; t < m.corners.size() / 3; ++t) {
    const dfm::TrianglePoint q = dfm::closest_on_triangle(p, m.corner(t, 0), m.corner(t, 1), m.corner(t, 2));
    const double value = key == dfm::DistanceKey::root ? std::sqrt(q.distance2) : q.distance2;
    if (value <= limit && value < best.key) best = {value, t, q};
  }
  return best;
}

// Triangles with their tree.
struct Soup {
  std::vector<uint32_t> corners;
  std::vector<double> x;  // [points,4]
  dfm::BoxTree tree{dfm::Memory::standard()};
  void point(Vec3 p) { x.insert(x.end(), {p.x, p.y, p.z, 0}); }
  dfm::Triangles renew() {
    tree.renew(corners, x.data());
    return {tree, corners, x.data()};
  }
};

Soup from(const test::Mesh &mesh) {
  Soup s;
  s.corners.assign(mesh.tri.begin(), mesh.tri.end());
  for (uint32_t i = 0; i < mesh.npoint(); ++i) s.point(dfm::load3(&mesh.x[3 * i]));
  return s;
}

// Corners on a coarse lattice, so that triangles lie in planes, share edges, coincide and have no area.
Soup lattice(std::mt19937 &random, uint32_t ntri) {
  Soup s;
  std::uniform_int_distribution<int> at(0, 4);
  for (uint32_t i = 0; i < 3 * ntri; ++i) {
    s.corners.push_back(i);
    s.point({0.25 * at(random), 0.25 * at(random), 0.25 * at(random)});
  }
  return s;
}

struct Directions {
  std::mt19937 random{7};
  std::uniform_real_distribution<double> uniform{-1, 1};
  Vec3 any() { return {uniform(random), uniform(random), uniform(random)}; }
  Vec3 unit() { return dfm::normalized(any()); }
  // Along an axis, or with one component zero.
  Vec3 flat() {
    Vec3 d = any();
    d[int(random() % 3)] = 0;
    if (random() % 2) d[int(random() % 3)] = 0;
    return dfm::norm2(d) > 0 ? dfm::normalized(d) : Vec3{0, 0, 1};
  }
};

void expect_same(const dfm::Triangles &m, Vec3 o, Vec3 d, double limit) {
  const dfm::TriangleOnRay want = every_triangle(m, o, d, limit), got = dfm::first_on_ray(m, o, d, limit);
  ASSERT_EQ(got.triangle, want.triangle)
      << o.x << " " << o.y << " " << o.z << ", " << d.x << " " << d.y << " " << d.z;
  ASSERT_EQ(got.distance, want.distance);
}
void expect_same(const dfm::Triangles &m, Vec3 p, dfm::DistanceKey key, double limit) {
  const dfm::TriangleNearPoint want = every_triangle(m, p, key, limit);
  const dfm::TriangleNearPoint got = dfm::closest_to(m, p, key, limit);
  ASSERT_EQ(got.triangle, want.triangle) << p.x << " " << p.y << " " << p.z;
  ASSERT_EQ(got.key, want.key);
  for (int k = 0; k < 3; ++k) ASSERT_EQ(got.at.weight[k], want.at.weight[k]);
}

dfm::World &inside(dfm_world w) { return *static_cast<dfm::World *>(dfm::handle_find(dfm::Kind::world, w)); }

// Bodies and mesh obstacles of a world without trees.
dfm_query_hit every_triangle(dfm::World &w, Vec3 o, Vec3 d) {
  dfm_query_hit hit{};
  hit.distance = kFar;
  hit.triangle = kNone;
  for (auto &b : w.bodies)
    for (uint32_t t = 0; t < b->surface.ntri; ++t) {
      Vec3 x[3];
      for (size_t k = 0; k < 3; ++k) x[k] = b->surface.sum(b->surface.tri[3 * size_t{t} + k], b->p.x.data());
      const double at = dfm::ray_triangle({o, d}, x[0], x[1], x[2]);
      if (!(at < hit.distance)) continue;
      hit.distance = at;
      hit.thing = b->handle;
      hit.triangle = t;
    }
  for (auto &ob : w.obstacles) {
    const dfm::Quat q = ob->pose.rotation;
    const Vec3 at_o = dfm::rotate_back(q, o - ob->pose.position), at_d = dfm::rotate_back(q, d);
    const auto met = [&](double at, uint32_t t) {
      if (!(at < hit.distance)) return;
      hit.distance = at;
      hit.thing = ob->handle;
      hit.triangle = t;
    };
    if (ob->def.shape == DFM_SHAPE_PLANE && -at_o.z / at_d.z >= 0) met(-at_o.z / at_d.z, kNone);
    for (size_t i = 0; i < ob->triangles.size(); i += 3) {
      const auto x = [&](size_t k) { return dfm::load3(&ob->points[size_t{3} * ob->triangles[i + k]]); };
      met(dfm::ray_triangle({at_o, at_d}, x(0), x(1), x(2)), uint32_t(i / 3));
    }
  }
  return hit;
}

dfm_query_hit every_triangle(dfm::World &w, Vec3 p) {
  dfm_query_hit hit{};
  hit.distance = kFar;
  for (auto &b : w.bodies)
    for (uint32_t t = 0; t < b->surface.ntri; ++t) {
      Vec3 x[3];
      for (size_t k = 0; k < 3; ++k) x[k] = b->surface.sum(b->surface.tri[3 * size_t{t} + k], b->p.x.data());
      const double d = std::sqrt(dfm::closest_on_triangle(p, x[0], x[1], x[2]).distance2);
      if (!(d < hit.distance)) continue;
      hit.distance = d;
      hit.thing = b->handle;
      hit.triangle = t;
    }
  return hit;
}

// The nearest hit of a ray along d, or (d zero) of a body's surface from o.
dfm_query_hit nearest(dfm::World &w, Vec3 o, Vec3 d) {
  dfm_query_hit hit{};
  hit.distance = kFar;
  hit.triangle = kNone;
  dfm_query_hits hits{sizeof hits, sizeof hit, 1, 0, &hit};
  dfm_query_filter bodies = dfm_query_filter_default();
  bodies.what = DFM_QUERY_BODIES;
  dfm::ThingQuery q;
  q.shape.position = o;
  q.point = true;
  q.way = {dfm::norm2(d) > 0, d};
  dfm::find(w, dfm::ThingFilter(q.way.moves ? nullptr : &bodies), q, dfm::keep_nearest, &hits);
  return hit;
}

// The answers now are those of every triangle as it is now.
void expect_now(dfm_world world, const char *when) {
  dfm::World &w = inside(world);
  Directions at;
  for (int i = 0; i < 40; ++i) {
    const Vec3 o = Vec3{0.05, 0.05, 0.1} + 0.3 * at.any();
    const Vec3 d = dfm::normalized(Vec3{0.05, 0.05, 0.1} - o + 0.05 * at.any());
    const dfm_query_hit want = every_triangle(w, o, d), got = nearest(w, o, d);
    ASSERT_EQ(got.distance, want.distance) << when << ", ray " << i;
    ASSERT_EQ(got.thing, want.thing) << when;
    ASSERT_EQ(got.triangle, want.triangle) << when;
    const dfm_query_hit point = every_triangle(w, o), near = nearest(w, o, {});
    ASSERT_EQ(near.distance, point.distance) << when << ", point " << i;
    ASSERT_EQ(near.thing, point.thing) << when;
    ASSERT_EQ(near.triangle, point.triangle) << when;
  }
}

dfm_obstacle add_ball(dfm_world w) {
  const test::Mesh ball = test::sphere_mesh(0.05, 2);
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.shape = DFM_SHAPE_MESH;
  d.npoint = ball.npoint();
  d.points = ball.x.data();
  d.ntriangle = ball.ntri();
  d.triangles = ball.tri.data();
  d.pose.position[0] = 0.25;
  d.pose.position[2] = 0.2;
  d.pose.rotation[0] = 0.6;
  d.pose.rotation[3] = 0.8;
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w, &d, &o));
  return o;
}

}  // namespace

TEST(Search, RaysAtASphere_AreThoseOfEveryTriangle) {
  Soup s = from(test::sphere_mesh(1, 4));
  const dfm::Triangles m = s.renew();
  Directions at;
  for (int i = 0; i < 600; ++i) {
    const Vec3 o = 2.0 * at.any();  // a quarter of them inside
    expect_same(m, o, at.unit(), kFar);
    expect_same(m, o, dfm::normalized(0.3 * at.any() - o), kFar);
    expect_same(m, o, dfm::normalized(0.3 * at.any() - o), 1);
    const uint32_t t = at.random() % (uint32_t(m.corners.size()) / 3);
    // at a corner and an edge, where many triangles meet
    expect_same(m, o, dfm::normalized(m.corner(t, 0) - o), kFar);
    expect_same(m, o, dfm::normalized(0.5 * (m.corner(t, 0) + m.corner(t, 1)) - o), kFar);
  }
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Search, PointsAroundASphere_AreThoseOfEveryTriangle) {
  Soup s = from(test::sphere_mesh(1, 4));
  const dfm::Triangles m = s.renew();
  Directions at;
  for (int i = 0; i < 600; ++i)
    for (const auto key : {dfm::DistanceKey::root, dfm::DistanceKey::squared}) {
      const uint32_t t = at.random() % (uint32_t(m.corners.size()) / 3);
      expect_same(m, 2.0 * at.any(), key, kFar);
      expect_same(m, 2.0 * at.any(), key, 0.2);
      expect_same(m, 0.01 * at.any(), key, kFar);
      expect_same(m, m.corner(t, 0), key, kFar);
      expect_same(m, 1.5 * (m.corner(t, 0) + m.corner(t, 1)), key, kFar);
    }
  expect_same(m, Vec3{}, dfm::DistanceKey::root, kFar);  // all nearly as close
}

TEST(Search, OfFlatAndDegenerateTriangles_IsThatOfEveryTriangle) {
  std::mt19937 random(3);
  for (const uint32_t ntri : {1u, 8u, 9u, 200u}) {
    Soup s = lattice(random, ntri);
    const dfm::Triangles m = s.renew();
    Directions at;
    for (int i = 0; i < 400; ++i) {
      const Vec3 on{0.25 * (at.random() % 5), 0.25 * (at.random() % 5), 0.125 * (at.random() % 9)};
      expect_same(m, on, at.unit(), kFar);
      expect_same(m, on, at.flat(), kFar);
      expect_same(m, on - 3.0 * at.flat(), at.flat(), kFar);
      expect_same(m, on, dfm::DistanceKey::root, kFar);
      expect_same(m, on + 0.5 * at.any(), dfm::DistanceKey::squared, kFar);
    }
  }
}

TEST(Search, AfterTrianglesHaveMoved_IsThatOfEveryTriangle) {
  Soup s = from(test::sphere_mesh(1, 3));
  Directions at;
  for (int round = 0; round < 12; ++round) {
    for (double &x : s.x) x += 0.15 * at.uniform(at.random);  // boxes grow until the tree is built anew
    for (size_t i = 3; i < s.x.size(); i += 4) s.x[i] = 0;
    const dfm::Triangles m = s.renew();
    for (int i = 0; i < 60; ++i) {
      const Vec3 o = 2.0 * at.any();
      expect_same(m, o, dfm::normalized(0.5 * at.any() - o), kFar);
      expect_same(m, o, dfm::DistanceKey::root, kFar);
    }
  }
}

TEST(Search, OfNothing_FindsNothing) {
  Soup s;
  const dfm::Triangles m = s.renew();
  EXPECT_EQ(dfm::first_on_ray(m, {}, {1, 0, 0}, kFar).triangle, kNone);
  EXPECT_EQ(dfm::closest_to(m, {}, dfm::DistanceKey::root, kFar).triangle, kNone);
}

// What is looked at grows with the logarithm of their number.
TEST(Search, AmongManyTriangles_LooksAtFew) {
  Soup s = from(test::sphere_mesh(1, 7));
  const dfm::Triangles m = s.renew();
  ASSERT_EQ(m.corners.size() / 3, 131072u);
  Directions at;
  dfm::SearchCount rays, points;
  constexpr int kQueries = 500;
  for (int i = 0; i < kQueries; ++i) {
    const Vec3 o = 1.5 * at.unit();
    EXPECT_NE(dfm::first_on_ray(m, o, dfm::normalized(0.5 * at.any() - o), kFar, &rays).triangle, kNone);
    EXPECT_NE(dfm::closest_to(m, 1.2 * at.unit(), dfm::DistanceKey::root, kFar, &points).triangle, kNone);
  }
  EXPECT_LT(double(rays.nodes) / kQueries, 100);
  EXPECT_LT(double(rays.triangles) / kQueries, 20);
  EXPECT_LT(double(points.nodes) / kQueries, 200);
  EXPECT_LT(double(points.triangles) / kQueries, 40);
}

// Every way in which positions change is seen by the next question.
TEST(Queries, AfterEveryChangeOfPositions_SeeThemAsTheyAre) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  const dfm_obstacle ball = add_ball(s.world);
  expect_now(s.world, "at the start");
  for (int i = 0; i < 5; ++i) {
    test::ok(dfm_world_step(s.world, 1e-3, nullptr));
    expect_now(s.world, "after a step");
  }
  size_t bytes = 0;
  test::ok(dfm_world_snapshot(s.world, nullptr, &bytes));
  std::vector<char> snapshot(bytes);
  test::ok(dfm_world_snapshot(s.world, snapshot.data(), &bytes));

  dfm_body_info info{};
  test::ok(dfm_body_get_info(s.upper, &info));
  std::vector<double> x(3 * info.npoint);
  uint32_t n = 0;
  test::ok(dfm_body_get_state(s.upper, info.npoint, x.data(), nullptr, &n));
  for (size_t i = 0; i < x.size(); i += 3) x[i] += 0.03;
  test::ok(dfm_body_set_state(s.upper, n, x.data(), nullptr));
  expect_now(s.world, "after a state was set");
  const dfm_pose pose{{0.2, 0, 0.1}, {0, 0, 0, 1}};
  test::ok(dfm_obstacle_teleport(ball, &pose));
  expect_now(s.world, "after an obstacle was put elsewhere");
  test::ok(dfm_world_restore(s.world, snapshot.data(), bytes));
  expect_now(s.world, "after a restore");

  test::ok(dfm_world_step(s.world, 1e-3, nullptr));
  expect_now(s.world, "before a step that is stopped");
  test::ok(dfm_world_interrupt(s.world));
  EXPECT_EQ(dfm_world_step(s.world, 0.05, nullptr), DFM_DISCARD);
  expect_now(s.world, "after it");
  test::ok(dfm_world_set_budget(s.world, 0, 4000));
  uint32_t trouble = 0;
  test::ok(dfm_world_step(s.world, 0.05, &trouble));
  EXPECT_TRUE(trouble & DFM_TROUBLE_BUDGET);
  expect_now(s.world, "after it");

  test::ok(dfm_body_destroy(s.lower));
  expect_now(s.world, "without the lower cube");
}

TEST(Queries, Untangled_SeeBodiesWhereTheyWerePut) {
  test::Context c;
  const test::Stack s = test::make_stack(c, -0.02);
  expect_now(s.world, "crossed");
  uint32_t left = 0;
  test::ok(dfm_world_untangle(s.world, &left));
  expect_now(s.world, "apart");
}

TEST(Queries, OnSeveralThreads_GiveTheSameResults) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  add_ball(s.world);
  for (int round = 0; round < 3; ++round) {
    test::ok(dfm_world_step(s.world, 1e-3, nullptr));  // so that all threads find the trees out of date
    std::vector<std::vector<double>> results(4);
    std::vector<std::thread> threads;
    std::atomic<int> ready{0};
    for (auto &own : results)
      threads.emplace_back([&] {
        Directions at;
        for (++ready; ready < 4;) {}
        for (int i = 0; i < 50; ++i) {
          const Vec3 o = 0.4 * at.any(), d = at.any();
          own.push_back(nearest(inside(s.world), o, dfm::normalized(d)).distance);
          own.push_back(nearest(inside(s.world), o, {}).distance);
        }
      });
    for (std::thread &t : threads) t.join();
    for (const auto &own : results) EXPECT_EQ(own, results[0]);
  }
}
