// Overlaps, casts, all hits of a ray and closest points with filters, through the public API.
#include <algorithm>
#include <cstring>
#include <thread>

#include "heap_calls.h"
#include "obstacle.h"
#include "query.h"
#include "rigid.h"
#include "stack.h"

namespace {

using Vec = std::array<double, 3>;

using test::sphere;

dfm_query_shape box(Vec at, Vec half) {
  dfm_query_shape s = sphere(at, 0);
  s.shape = DFM_SHAPE_BOX;
  std::copy(half.begin(), half.end(), s.half_size);
  return s;
}
dfm_query_shape capsule(Vec at, double half, double r) {
  dfm_query_shape s = sphere(at, r);
  s.shape = DFM_SHAPE_CAPSULE;
  s.half_length = half;
  return s;
}

dfm_obstacle add(dfm_world w, const char *name, uint32_t shape, Vec at, uint32_t category = 1) {
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = name;
  d.shape = shape;
  d.radius = 0.2;
  d.half_length = 0.5;
  d.half_size[0] = 0.1;
  d.half_size[1] = 0.2;
  d.half_size[2] = 0.3;
  d.category = category;
  std::copy(at.begin(), at.end(), d.pose.position);
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w, &d, &o));
  return o;
}

std::vector<uint64_t> overlaps(dfm_world w, const dfm_query_shape &s, const dfm_query_filter *f = nullptr) {
  std::vector<uint64_t> things;
  for (const dfm_query_hit &h : test::query(w, s, nullptr, 0, f)) {
    EXPECT_EQ(h.distance, 0);
    EXPECT_EQ(h.flags, uint32_t{DFM_QUERY_INSIDE});
    things.push_back(h.thing);
  }
  return things;
}
dfm_query_hit cast(dfm_world w, const dfm_query_shape &s, Vec path, const dfm_query_filter *f = nullptr) {
  return test::nearest(w, s, path.data(), 0, f);
}
std::vector<dfm_query_hit> all_hits(dfm_world w, Vec o, Vec d, double most = 100, uint32_t capacity = 64,
                                    const dfm_query_filter *f = nullptr) {
  return test::query(w, test::point(o, DFM_QUERY_EACH), d.data(), most, f, capacity);
}

using Things = std::vector<uint64_t>;

// A floor, two soft cubes of 0.1 m on it, a ball, a box, a capsule and a mesh in a row along x.
struct Yard : test::Stack {
  dfm_obstacle ball, crate, pill, mesh;
  explicit Yard(dfm_context *c) : test::Stack(test::make_stack(c)) {
    ball = add(world, "ball", DFM_SHAPE_SPHERE, {1, 0, 1});
    crate = add(world, "crate", DFM_SHAPE_BOX, {2, 0, 1}, 2);
    pill = add(world, "pill", DFM_SHAPE_CAPSULE, {3, 0, 1}, 4);
    const test::Triangles cube = test::box_surface({0.1, 0.1, 0.1}, 2);
    dfm_obstacle_def d = test::mesh_def("mesh", cube);
    d.pose.position[0] = 4;
    d.pose.position[2] = 1;
    d.pose.rotation[2] = std::sqrt(0.5);
    d.pose.rotation[3] = std::sqrt(0.5);
    test::ok(dfm_obstacle_create(world, &d, &mesh));
  }
};

}  // namespace

TEST(QueryOverlap, FindsSurfacesAndWhatIsWithin) {
  test::Context c;
  const Yard y(c);
  EXPECT_EQ(overlaps(y.world, sphere({0.05, 0.05, 0.05}, 0.001)), Things{y.lower}) << "deep within a body";
  EXPECT_EQ(overlaps(y.world, sphere({0.05, 0.05, 0.1002}, 0.01)), (Things{y.lower, y.upper}));
  EXPECT_EQ(overlaps(y.world, sphere({0.05, 0.05, 0}, 0.11)), (Things{y.lower, y.upper, y.floor}));
  EXPECT_EQ(overlaps(y.world, sphere({9, 9, -3}, 0.1)), Things{y.floor}) << "below a plane";
  EXPECT_EQ(overlaps(y.world, sphere({9, 9, 3}, 0.1)), Things{});
  EXPECT_EQ(overlaps(y.world, sphere({1, 0, 1.3}, 0.1001)), Things{y.ball});
  EXPECT_EQ(overlaps(y.world, sphere({1, 0, 1.3}, 0.0999)), Things{});
  EXPECT_EQ(overlaps(y.world, box({1.5, 0, 1}, {0.4001, 0.1, 0.1})), (Things{y.ball, y.crate}));
  EXPECT_EQ(overlaps(y.world, box({1.5, 0, 1}, {0.3999, 0.1, 0.1})), Things{y.ball});
  EXPECT_EQ(overlaps(y.world, capsule({3.3, 0, 1}, 0.1, 0.11)), Things{y.pill});
  EXPECT_EQ(overlaps(y.world, sphere({4, 0, 1}, 0.01)), Things{y.mesh}) << "within a closed mesh";
  EXPECT_EQ(overlaps(y.world, sphere({4.12, 0, 1}, 0.01)), Things{});
  const double points[] = {-0.5, 0, 0, 0.5, 0, 0, 0, 0.1, 0.05};
  dfm_query_shape hull = sphere({4.59, 0, 1}, 0);
  hull.shape = DFM_SHAPE_CONVEX;
  hull.npoint = 3;
  hull.points = points;
  EXPECT_EQ(overlaps(y.world, hull), Things{y.mesh});
  hull.pose.position[0] = 4.61;
  EXPECT_EQ(overlaps(y.world, hull), Things{});
  EXPECT_EQ(test::query(y.world, box({1.5, 0, 1}, {0.6, 0.1, 0.1}), nullptr, 0, nullptr, 1)[0].thing, y.ball)
      << "ball and crate; there is room for one";
}

TEST(QueryOverlap, TrianglesOfABody_AreThoseOfTheShapesPlace) {
  test::Context c;
  const Yard y(c);
  dfm_body_info info{};
  test::ok(dfm_body_get_info(y.lower, &info));
  dfm_query_filter lower = dfm_query_filter_default();
  lower.only = y.lower;
  lower.what = 0;  // counts no more
  const auto triangles = [&](dfm_query_shape s) {
    s.flags = DFM_QUERY_EACH;
    std::vector<uint32_t> list;
    for (const dfm_query_hit &h : test::query(y.world, s, nullptr, 0, &lower, 2 * info.ntriangle))
      if (h.triangle != UINT32_MAX) list.push_back(h.triangle);
    EXPECT_TRUE(std::is_sorted(list.begin(), list.end()));
    return list;
  };
  EXPECT_EQ(triangles(sphere({0.05, 0.05, 0.05}, 1)).size(), info.ntriangle);
  const std::vector<uint32_t> list = triangles(box({0, 0.05, 0.05}, {0.001, 0.2, 0.2}));
  const size_t n = list.size();
  EXPECT_GT(n, 0u);
  EXPECT_LT(n, info.ntriangle);
  std::vector<double> x(3 * info.nsurfel);
  std::vector<uint32_t> tri(3 * info.ntriangle);
  test::ok(dfm_surface_positions(y.lower, info.nsurfel, x.data(), nullptr));
  test::ok(dfm_surface_triangles(y.lower, info.ntriangle, tri.data(), nullptr));
  for (size_t i = 0; i < n; ++i) {
    double least = 1;
    for (size_t k = 0; k < 3; ++k) least = std::min(least, x[3 * tri[3 * list[i] + k]]);
    EXPECT_LE(least, 0.001);
  }
}

TEST(QueryFilter, KindsMasksAndTheCallback_LeaveThingsOut) {
  test::Context c;
  const Yard y(c);
  const dfm_rigid plate = test::create(y.world, {test::box("plate", {0.2, 0.2, 0.2}, 1, {0, 5, 1})}, {})[0];
  const dfm_query_shape all = sphere({0, 0, 0}, 20);
  const Things every{y.lower, y.upper, y.floor, y.ball, y.crate, y.pill, y.mesh, plate};
  EXPECT_EQ(overlaps(y.world, all), every);
  dfm_query_filter f = dfm_query_filter_default();
  EXPECT_EQ(overlaps(y.world, all, &f), every);
  f.what = DFM_QUERY_BODIES;
  EXPECT_EQ(overlaps(y.world, all, &f), (Things{y.lower, y.upper}));
  f.what = DFM_QUERY_RIGIDS;
  EXPECT_EQ(overlaps(y.world, all, &f), Things{plate});
  f.what = DFM_QUERY_OBSTACLES;
  f.collides_with = 6;
  EXPECT_EQ(overlaps(y.world, all, &f), (Things{y.crate, y.pill}));
  f = dfm_query_filter_default();
  f.category = 0;
  EXPECT_EQ(overlaps(y.world, all, &f), Things{});
  f = dfm_query_filter_default();
  struct Calls {
    Things things;
    uint64_t not_this;
  } calls{{}, y.crate};
  f.user = &calls;
  f.accept = [](void *user, uint64_t thing) {
    Calls &a = *static_cast<Calls *>(user);
    a.things.push_back(thing);
    return thing != a.not_this;
  };
  f.what = DFM_QUERY_OBSTACLES;
  f.collides_with = 3;
  EXPECT_EQ(overlaps(y.world, all, &f), (Things{y.floor, y.ball, y.mesh}));
  EXPECT_EQ(calls.things, (Things{y.floor, y.ball, y.crate, y.mesh})) << "once each, in order of creation";
  const dfm_query_hit hit = cast(y.world, sphere({1.5, 0, 1}, 0.1), {5, 0, 0}, &f);
  EXPECT_EQ(hit.thing, y.mesh) << "the crate is refused, the pill masked";
  EXPECT_NEAR(hit.distance, 4 - 0.1 - 0.1 - 1.5, 1e-8);
}

TEST(QueryFilter, ACallbackThatChangesTheWorld_IsRefused) {
  test::Context c;
  const Yard y(c);
  dfm_query_filter f = dfm_query_filter_default();
  struct Calls {
    dfm_world w;
    dfm_body b;
    int refused;
  } calls{y.world, y.upper, 0};
  f.user = &calls;
  f.accept = [](void *user, uint64_t) {
    Calls &a = *static_cast<Calls *>(user);
    a.refused += dfm_body_destroy(a.b) == DFM_E_BUSY;
    a.refused += dfm_world_step(a.w, 1e-3, nullptr) == DFM_E_BUSY;
    test::says({"busy with another call"});
    return true;
  };
  EXPECT_EQ(overlaps(y.world, sphere({0, 0, 0}, 20), &f).size(), 7u);
  EXPECT_EQ(calls.refused, 14);
}

TEST(QueryCast, EveryShape_MeetsEveryThingWhereFormulasSay) {
  test::Context c;
  const Yard y(c);
  struct Case {
    dfm_query_shape shape;
    double reach;  // along x
  };
  dfm_query_shape turned = box({0, 0, 1}, {0.1, 0.05, 0.05});
  turned.pose.rotation[2] = std::sin(M_PI / 8);
  turned.pose.rotation[3] = std::cos(M_PI / 8);
  const Case cases[] = {{sphere({0, 0, 1}, 0.1), 0.1},
                        {sphere({0, 0, 1}, 0), 0},
                        {box({0, 0, 1}, {0.1, 0.05, 0.05}), 0.1},
                        {capsule({0, 0, 1}, 0.02, 0.05), 0.05}};
  for (const Case &k : cases) {
    dfm_query_filter f = dfm_query_filter_default();
    const auto meets = [&](double from, uint64_t thing, double face, const char *what) {
      SCOPED_TRACE(what);
      dfm_query_shape s = k.shape;
      s.pose.position[0] = from;
      const dfm_query_hit hit = cast(y.world, s, {1, 0, 0}, &f);
      EXPECT_EQ(hit.thing, thing);
      EXPECT_NEAR(hit.distance, face - k.reach - from, 2e-9);
      EXPECT_NEAR(hit.normal[0], -1, 1e-6);
      EXPECT_NEAR(hit.point[0], face, 1e-8);
    };
    meets(0.3, y.ball, 0.8, "ball");
    meets(1.4, y.crate, 1.9, "crate");
    meets(2.4, y.pill, 2.8, "pill");
    meets(3.4, y.mesh, 3.9, "mesh");
    dfm_query_shape s = k.shape;
    s.pose.position[1] = 7;
    const dfm_query_hit down = cast(y.world, s, {0, 0, -3}, &f);
    EXPECT_EQ(down.thing, y.floor);
    EXPECT_NEAR(down.normal[2], 1, 1e-12);
    EXPECT_NEAR(down.point[2], 0, 1e-12);
    EXPECT_EQ(cast(y.world, s, {0, 0, 3}).thing, 0u) << "free";
    EXPECT_TRUE(std::isinf(cast(y.world, s, {0, 0, 3}).distance));
  }
  const double reach = (0.1 + 0.05) * std::sqrt(0.5);
  turned.pose.position[0] = 1.4;
  EXPECT_NEAR(cast(y.world, turned, {1, 0, 0}).distance, 1.9 - reach - 1.4, 2e-9)
      << "an edge of a turned box";
  const dfm_query_hit soft = cast(y.world, sphere({-1, 0.05, 0.05}, 0.02), {3, 0, 0});
  EXPECT_EQ(soft.thing, y.lower);
  EXPECT_NEAR(soft.distance, 0.98, 1e-9);
  EXPECT_NE(soft.triangle, UINT32_MAX);
}

TEST(QueryCast, WhatOverlapsAtTheStart_IsHitAtOnce) {
  test::Context c;
  const Yard y(c);
  const auto inside = [&](const dfm_query_shape &s, uint64_t thing, const char *what) {
    const dfm_query_hit hit = cast(y.world, s, {0, 0, 2});
    EXPECT_EQ(hit.thing, thing) << what;
    EXPECT_EQ(hit.distance, 0) << what;
    EXPECT_EQ(hit.flags, uint32_t{DFM_QUERY_INSIDE}) << what;
    EXPECT_EQ(hit.normal[2], -1) << what;
  };
  inside(sphere({0.05, 0.05, 0.05}, 0.001), y.lower, "within a body");
  inside(sphere({0.05, 0.05, 0.05}, 0.06), y.lower, "through its surface");
  inside(sphere({1, 0, 1}, 0.01), y.ball, "within a ball");
  inside(sphere({4, 0, 1}, 0.01), y.mesh, "within a mesh");
  inside(sphere({9, 9, -1}, 0.01), y.floor, "below the smallest step");
  const dfm_query_hit still = cast(y.world, sphere({1, 0, 1}, 0.01), {0, 0, 0});
  EXPECT_EQ(still.thing, y.ball) << "a path of no length";
  EXPECT_EQ(cast(y.world, sphere({1.5, 0, 1}, 0.01), {0, 0, 0}).thing, 0u);
}

TEST(QueryRay, AllHits_AreSortedAndTheNearestAreKept) {
  test::Context c;
  const Yard y(c);
  const std::vector<dfm_query_hit> hits = all_hits(y.world, {-1, 0.013, 1.007}, {2, 0, 0});
  Things things;
  for (const dfm_query_hit &h : hits) things.push_back(h.thing);
  EXPECT_EQ(things, (Things{y.ball, y.ball, y.crate, y.crate, y.pill, y.pill, y.mesh, y.mesh}));
  for (size_t i = 0; i < hits.size(); ++i) {
    EXPECT_EQ(hits[i].normal[0] < 0, i % 2 == 0) << "enters, then leaves";
    if (i > 0) {
      EXPECT_GT(hits[i].distance, hits[i - 1].distance);
    }
    EXPECT_NEAR(hits[i].point[0], hits[i].distance - 1, 1e-12);
  }
  EXPECT_NEAR(hits[3].distance, 3.1, 1e-12) << "where it leaves the crate";
  const std::vector<dfm_query_hit> three = all_hits(y.world, {-1, 0.013, 1.007}, {2, 0, 0}, 100, 3);
  ASSERT_EQ(three.size(), 3u);
  for (size_t i = 0; i < 3; ++i) EXPECT_EQ(three[i].distance, hits[i].distance);
  const Vec o{-1, 0.013, 1.007}, d{1, 0, 0};
  const dfm_query_shape from = test::point(o, DFM_QUERY_EACH);
  dfm_query_hits count{sizeof count, sizeof(dfm_query_hit), 0, 0, nullptr};
  test::ok(dfm_world_query(y.world, &from, d.data(), 100, nullptr, nullptr, &count));
  EXPECT_EQ(count.n, 8u);
  EXPECT_EQ(all_hits(y.world, o, d, 3.05).size(), 3u) << "up to max_distance";
  EXPECT_EQ(all_hits(y.world, {2, 0, 1}, d, 1).size(), 2u) << "from within: out of the crate, into the pill";
  const std::vector<dfm_query_hit> down = all_hits(y.world, {0.061, 0.047, 5}, {0, 0, -1});
  ASSERT_EQ(down.size(), 5u);
  EXPECT_EQ(down[0].thing, y.upper);
  EXPECT_EQ(down[4].thing, y.floor);
  EXPECT_EQ(test::ray(y.world, o, d, 100).distance, hits[0].distance);
}

TEST(Query, TheFunctionThatGetsHits_SaysHowFarToGo) {
  test::Context c;
  const Yard y(c);
  struct Seen {
    const Yard &y;
    std::vector<dfm_query_hit> hits;
    double (*next)(const dfm_query_hit &);
  } seen{y, {}, nullptr};
  const dfm_query_shape from = sphere({5, 0.013, 1.007}, 0.01);
  const double path[3] = {-9, 0, 0};
  const auto things = [&](double (*next)(const dfm_query_hit &)) {
    seen.hits.clear();
    seen.next = next;
    test::ok(dfm_world_query(
        y.world, &from, path, 0, nullptr,
        [](void *user, const dfm_query_hit *hit) {
          Seen &s = *static_cast<Seen *>(user);
          s.hits.push_back(*hit);
          EXPECT_EQ(dfm_obstacle_destroy(s.y.ball), DFM_E_BUSY);
          EXPECT_EQ(overlaps(s.y.world, sphere({1, 0, 1}, 0)), Things{s.y.ball}) << "it may query";
          return s.next(*hit);
        },
        &seen));
    Things out;
    for (const dfm_query_hit &h : seen.hits) out.push_back(h.thing);
    return out;
  };
  EXPECT_EQ(things([](const dfm_query_hit &) { return double{INFINITY}; }),
            (Things{y.ball, y.crate, y.pill, y.mesh}))
      << "in order of creation, each once";
  EXPECT_EQ(things([](const dfm_query_hit &h) { return h.distance; }),
            (Things{y.ball, y.crate, y.pill, y.mesh}))
      << "each nearer than the one before";
  EXPECT_EQ(things([](const dfm_query_hit &) { return -1.0; }), Things{y.ball});
  EXPECT_EQ(things([](const dfm_query_hit &h) { return h.distance - 1.05; }), (Things{y.ball, y.pill}))
      << "the next ones are only 1 m nearer";
}

TEST(QueryClosest, OfAnyShape_IsTheGapToTheNearestThing) {
  test::Context c;
  const Yard y(c);
  const auto gap = [&](const dfm_query_shape &s, double reach = 10) {
    return test::nearest(y.world, s, nullptr, reach);
  };
  dfm_query_hit hit = gap(sphere({1, 0, 1.5}, 0.1));
  EXPECT_EQ(hit.thing, y.ball);
  EXPECT_NEAR(hit.distance, 0.2, 1e-12);
  EXPECT_NEAR(hit.point[2], 1.2, 1e-12);
  EXPECT_NEAR(hit.normal[2], 1, 1e-12);
  hit = gap(box({4.3, 0.03, 1.01}, {0.05, 0.02, 0.02}));
  EXPECT_EQ(hit.thing, y.mesh);
  EXPECT_NEAR(hit.distance, 0.15, 1e-12);
  EXPECT_NE(hit.triangle, UINT32_MAX);
  EXPECT_NEAR(hit.normal[0], 1, 1e-12);
  EXPECT_EQ(gap(box({4.3, 0.03, 1.01}, {0.05, 0.02, 0.02}), 0.1499).thing, 0u);
  hit = gap(capsule({9, 9, 0.7}, 0.3, 0.1));
  EXPECT_EQ(hit.thing, y.floor);
  EXPECT_NEAR(hit.distance, 0.3, 1e-12);
  EXPECT_NEAR(hit.point[2], 0, 1e-12);
  hit = gap(sphere({4, 0, 1}, 0.01));
  EXPECT_EQ(hit.thing, y.mesh) << "within it";
  EXPECT_EQ(hit.distance, 0);
  EXPECT_EQ(hit.flags, uint32_t{DFM_QUERY_INSIDE});
  dfm_query_shape each = sphere({4.15, 0.03, 1.01}, 0.01);
  each.flags = DFM_QUERY_EACH;
  const std::vector<dfm_query_hit> faces = test::query(y.world, each, nullptr, 0.041);
  ASSERT_FALSE(faces.empty());
  EXPECT_NEAR(faces[0].distance, 0.04, 1e-12);
  EXPECT_LT(faces.size(), 6u) << "triangles of the mesh's side alone";
}

TEST(QueryClosest, OfAPoint_EachCountsSurfacesAloneAlsoFromInside) {
  test::Context c;
  const Yard y(c);
  const auto expect = [&](Vec from, uint64_t thing, double distance, Vec at, Vec normal) {
    const double reach = distance + 1e-9;
    const std::vector<dfm_query_hit> hits =
        test::query(y.world, test::point(from, DFM_QUERY_EACH), nullptr, reach);
    ASSERT_FALSE(hits.empty());
    const dfm_query_hit one = test::nearest(y.world, test::point(from), nullptr, reach);
    EXPECT_EQ(std::memcmp(&hits[0], &one, sizeof one), 0) << "the nearest one is first";
    for (const dfm_query_hit &h : hits) {
      EXPECT_EQ(h.thing, thing);
      EXPECT_EQ(h.flags, 0u);
      EXPECT_EQ(h.triangle != UINT32_MAX, thing == y.mesh || thing == y.upper);
      EXPECT_NEAR(h.distance, distance, 1e-12);
      for (size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(h.point[k], at[k], 1e-12);
        EXPECT_NEAR(h.normal[k], normal[k], 1e-12);
      }
    }
  };
  expect({4.15, 0, 1}, y.mesh, 0.05, {4.1, 0, 1}, {1, 0, 0});
  expect({4.06, 0, 1}, y.mesh, 0.04, {4.1, 0, 1}, {1, 0, 0});
  expect({4.1, 0, 1}, y.mesh, 0, {4.1, 0, 1}, {1, 0, 0});
  expect({0.05, 0.05, 0.21}, y.upper, 0.21 - 0.2003, {0.05, 0.05, 0.2003}, {0, 0, 1});
  expect({1, 0, 1.15}, y.ball, 0.05, {1, 0, 1.2}, {0, 0, 1});
  expect({2.07, 0, 1}, y.crate, 0.03, {2.1, 0, 1}, {1, 0, 0});
  expect({9, 9, -0.3}, y.floor, 0.3, {9, 9, 0}, {0, 0, 1});
  EXPECT_TRUE(test::query(y.world, test::point({4, 0, 1}, DFM_QUERY_EACH), nullptr, 0.0999).empty());
}

TEST(Query, Count_IsOfAllHitsAndAsksTheFilterOnce) {
  test::Context c;
  const Yard y(c);
  const Vec o{-1, 0.013, 1.007}, d{1, 0, 0};
  const std::vector<dfm_query_hit> all = all_hits(y.world, o, d);
  ASSERT_EQ(all.size(), 8u);
  const dfm_query_shape from = test::point(o, DFM_QUERY_EACH | DFM_QUERY_COUNT);
  dfm_query_filter f = dfm_query_filter_default();
  int calls = 0;
  f.user = &calls;
  f.accept = [](void *user, uint64_t) { return ++*static_cast<int *>(user) > 0; };
  for (uint32_t capacity = 0; capacity <= 9; ++capacity) {
    dfm_query_hit rows[9];
    dfm_query_hits hits{sizeof hits, sizeof rows[0], capacity, 0, rows};
    calls = 0;
    test::ok(dfm_world_query(y.world, &from, d.data(), 100, &f, nullptr, &hits));
    EXPECT_EQ(hits.n, 8u);
    EXPECT_EQ(calls, 7);
    const uint32_t kept = std::min(capacity, 8u);
    for (uint32_t i = 0; i < kept; ++i) EXPECT_EQ(std::memcmp(&rows[i], &all[i], sizeof rows[i]), 0);
    uint32_t n = 0;
    calls = 0;
    test::ok(dfm_world_query_ray_all(y.world, o.data(), d.data(), 100, &f, capacity, rows, &n));
    EXPECT_EQ(n, 8u);
    EXPECT_EQ(calls, 7);
    for (uint32_t i = 0; i < kept; ++i) EXPECT_EQ(std::memcmp(&rows[i], &all[i], sizeof rows[i]), 0);
  }
}

TEST(QueryFilter, OnlyWhatIsNoThingOfTheWorld_IsRefused) {
  test::Context c;
  const Yard y(c), other(c);
  dfm_query_filter f = dfm_query_filter_default();
  f.accept = [](void *, uint64_t) { return false; };
  const dfm_query_shape all = sphere({0, 0, 0}, 20);
  for (const uint64_t thing : {y.lower, y.floor, y.mesh}) {
    f.only = thing;
    EXPECT_EQ(overlaps(y.world, all, &f), Things{thing}) << "accept is not asked";
  }
  dfm_query_hits hits{sizeof hits, sizeof(dfm_query_hit), 0, 7, nullptr};
  const auto request = [&](uint64_t only) {
    f.only = only;
    return dfm_world_query(y.world, &all, nullptr, 0, &f, nullptr, &hits);
  };
  for (const uint64_t thing : {other.lower, other.floor, y.world, uint64_t{12345}})
    EXPECT_EQ(request(thing), DFM_E_HANDLE);
  test::ok(dfm_obstacle_destroy(y.pill));
  EXPECT_EQ(request(y.pill), DFM_E_HANDLE);
  uint32_t n = 7;
  dfm_cut_def d = dfm_cut_def_default();
  for (double &half : d.half_size) half = 1;
  test::ok(dfm_body_cut(y.lower, &d, nullptr));
  EXPECT_EQ(request(y.lower), DFM_E_STATE);
  test::says({"lower", "no cells left"});
  EXPECT_EQ(dfm_body_query_triangles(y.lower, &all, 0, nullptr, &n), DFM_E_STATE);
  EXPECT_EQ(n, 7u);
  EXPECT_EQ(hits.n, 7u);
}

TEST(QueryRay, RowsOfANewerHeader_HaveZeroBehind) {
  test::Context c;
  const Yard y(c);
  const Vec o{-1, 0.013, 1.007}, d{1, 0, 0};
  constexpr uint32_t row = sizeof(dfm_query_hit) + 16;
  std::vector<unsigned char> out(9 * row, 0xa5);
  const dfm_query_shape from = test::point(o, DFM_QUERY_EACH);
  dfm_query_hits hits{sizeof hits, row, 8, 0, reinterpret_cast<dfm_query_hit *>(out.data())};
  test::ok(dfm_world_query(y.world, &from, d.data(), 100, nullptr, nullptr, &hits));
  EXPECT_EQ(hits.n, 8u);
  double last = 0;
  for (uint32_t i = 0; i < 8; ++i) {
    dfm_query_hit h;
    std::memcpy(&h, &out[i * row], sizeof h);
    EXPECT_GT(h.distance, last);
    last = h.distance;
    for (uint32_t k = sizeof h; k < row; ++k) EXPECT_EQ(out[i * row + k], 0);
  }
  for (uint32_t k = 8 * row; k < 9 * row; ++k) EXPECT_EQ(out[k], 0xa5);
  hits = {sizeof hits, 72, 0, 9, nullptr};
  EXPECT_EQ(dfm_world_query(y.world, &from, d.data(), 100, nullptr, nullptr, &hits), DFM_E_ARG);
  EXPECT_EQ(hits.n, 9u) << "untouched";
  test::says({"row_size 72", "sizeof(dfm_query_hit)"});
}

TEST(QueryClosest, IsTheNearestSurfaceOfAnyKind) {
  test::Context c;
  const Yard y(c);
  const auto closest = [&](Vec p, double most = 10, const dfm_query_filter *f = nullptr) {
    return test::nearest(y.world, test::point(p), nullptr, most, f);
  };
  dfm_query_hit hit = closest({1, 0, 1.5});
  EXPECT_EQ(hit.thing, y.ball);
  EXPECT_NEAR(hit.distance, 0.3, 1e-12);
  EXPECT_NEAR(hit.point[2], 1.2, 1e-12);
  EXPECT_NEAR(hit.normal[2], 1, 1e-12);
  hit = closest({4.15, 0.03, 1.01});
  EXPECT_EQ(hit.thing, y.mesh);
  EXPECT_NEAR(hit.distance, 0.05, 1e-12);
  EXPECT_NEAR(hit.point[0], 4.1, 1e-12);
  EXPECT_NEAR(hit.normal[0], 1, 1e-12);
  EXPECT_NEAR(closest({2.05, 0, 1}).distance, 0.05, 1e-12) << "from within the crate";
  EXPECT_EQ(closest({2, 0, 9}, 1).thing, 0u);
  dfm_query_filter f = dfm_query_filter_default();
  f.what = DFM_QUERY_BODIES;
  EXPECT_EQ(closest({1, 0, -0.2}, 10, &f).thing, y.lower);
}

TEST(Query, AfterAMotion_SeesWhereThingsAreNow) {
  test::Context c;
  const Yard y(c);
  dfm_pose away{{0, 0, 9}, {0, 0, 0, 1}};
  EXPECT_EQ(overlaps(y.world, sphere({1, 0, 1}, 0.1)), Things{y.ball});
  test::ok(dfm_obstacle_teleport(y.ball, &away));
  EXPECT_EQ(overlaps(y.world, sphere({1, 0, 1}, 0.1)), Things{});
  EXPECT_EQ(overlaps(y.world, sphere({0, 0, 9}, 0.1)), Things{y.ball});
  const double low = cast(y.world, sphere({0.05, 0.05, 5}, 0.01), {0, 0, -9}).distance;
  for (int i = 0; i < 5; ++i) test::ok(dfm_world_step(y.world, 1e-3, nullptr));
  EXPECT_GT(cast(y.world, sphere({0.05, 0.05, 5}, 0.01), {0, 0, -9}).distance, low) << "it has fallen";
  test::ok(dfm_body_destroy(y.upper));
  EXPECT_EQ(overlaps(y.world, sphere({0.05, 0.05, 0.15}, 0.01)), Things{});
  dfm_query_filter gone = dfm_query_filter_default();
  gone.only = y.upper;
  dfm_query_hits none{sizeof none, sizeof(dfm_query_hit), 0, 0, nullptr};
  const dfm_query_shape all = sphere({0, 0, 0}, 1);
  EXPECT_EQ(dfm_world_query(y.world, &all, nullptr, 0, &gone, nullptr, &none), DFM_E_HANDLE);
}

TEST(Query, OnSeveralThreads_GivesTheBitsOfOneAndTakesNoMemory) {
  test::Context c;
  const Yard y(c);
  test::ok(dfm_world_step(y.world, 1e-3, nullptr));
  struct Results {
    std::vector<double> numbers;
    void request(dfm_world w) {
      numbers.clear();
      for (int i = 0; i < 60; ++i) {
        const double at = -0.5 + 0.08 * i;
        dfm_query_hit rows[8];
        const auto query_all = [&](const dfm_query_shape &shape, const double *path, double reach) {
          dfm_query_hits hits{sizeof hits, sizeof(dfm_query_hit), 8, 0, rows};
          test::ok(dfm_world_query(w, &shape, path, reach, nullptr, nullptr, &hits));
          numbers.push_back(hits.n);
          for (uint32_t k = 0; k < hits.n; ++k)
            for (const double x :
                 {rows[k].distance, rows[k].point[0], rows[k].normal[1], double(rows[k].triangle)})
              numbers.push_back(x);
        };
        dfm_query_shape s = sphere({at, 0.02, 1.5}, 0.05);
        s.shape = i % 3 == 0 ? DFM_SHAPE_BOX : DFM_SHAPE_CAPSULE;
        s.half_length = s.half_size[0] = 0.04;
        const double path[3] = {0.1 * (i % 5), 0.01, -2};
        query_all(s, path, 0);
        query_all(s, nullptr, 10);
        query_all(s, nullptr, 0);
        query_all(test::point({at, 0.1, 0.3}), nullptr, 10);
        query_all(test::point({at, 0.1, 0.3}, DFM_QUERY_EACH), path, 10);
      }
    }
  };
  Results one[4];
  for (Results &a : one) a.numbers.reserve(1 << 14);
  std::vector<std::thread> threads;
  for (int t = 1; t < 4; ++t) threads.emplace_back([&, t] { one[t].request(y.world); });
  one[0].request(y.world);
  for (std::thread &t : threads) t.join();
  for (int t = 1; t < 4; ++t) EXPECT_EQ(one[t].numbers, one[0].numbers);
  const uint64_t heap = test::heap_calls;
  one[0].request(y.world);
  EXPECT_EQ(test::heap_calls - heap, 0u);
}

TEST(Query, AnEmptyWorld_ReturnsNothing) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  EXPECT_EQ(overlaps(w, sphere({0, 0, 0}, 1e9)), Things{});
  EXPECT_EQ(cast(w, sphere({0, 0, 0}, 1), {1, 1, 1}).thing, 0u);
  EXPECT_TRUE(all_hits(w, {0, 0, 0}, {0, 0, 1}).empty());
}

TEST(Query, WhatIsNoShapeRayOrFilter_IsRefusedWithASentence) {
  test::Context c;
  const Yard y(c);
  const double d[3] = {1, 0, 0}, none[3] = {0, 0, 0};
  dfm_query_hit rows[4];
  dfm_query_hits hits{sizeof hits, sizeof(dfm_query_hit), 4, 77, rows};
  const auto request = [&](const dfm_query_shape *s, const double *path, double reach,
                           const dfm_query_filter *f = nullptr) {
    return dfm_world_query(y.world, s, path, reach, f, nullptr, &hits);
  };
  const auto refused = [&](const dfm_query_shape &s, std::initializer_list<const char *> parts) {
    EXPECT_EQ(request(&s, nullptr, 0), DFM_E_ARG);
    test::says(parts);
    EXPECT_EQ(request(&s, d, 0), DFM_E_ARG);
  };
  refused(sphere({0, 0, 0}, -1), {"radius", "-1"});
  refused(sphere({NAN, 0, 0}, 1), {"position", "nan"});
  refused(sphere({0, 0, 0}, INFINITY), {"radius"});
  refused(box({0, 0, 0}, {1, NAN, 1}), {"half_size"});
  dfm_query_shape s = sphere({0, 0, 0}, 1);
  s.shape = DFM_SHAPE_PLANE;
  refused(s, {"shape 0", "DFM_SHAPE_CONVEX", "DFM_SHAPE_POINT"});
  s.shape = DFM_SHAPE_CONVEX;
  refused(s, {"no points"});
  const double bad[3] = {0, INFINITY, 0};
  s.npoint = 1;
  refused(s, {"points"});
  s.points = bad;
  refused(s, {"point 0"});
  s = sphere({0, 0, 0}, 1);
  s.pose.rotation[1] = NAN;
  refused(s, {"rotation"});
  s.size = 3;
  refused(s, {"size is 3"});
  s = sphere({0, 0, 0}, 1);
  s.flags = 6;
  refused(s, {"flags is 6"});
  s.flags = 0;
  EXPECT_EQ(request(&s, none, 1), DFM_E_ARG);
  test::says({"path is zero"});
  s.shape = DFM_SHAPE_POINT;
  EXPECT_EQ(request(&s, none, 0), DFM_E_ARG);
  EXPECT_EQ(request(&s, d, -1), DFM_E_ARG);
  EXPECT_EQ(request(&s, nullptr, NAN), DFM_E_ARG);
  test::says({"reach is nan"});
  EXPECT_EQ(request(nullptr, d, 1), DFM_E_ARG);
  dfm_query_filter f = dfm_query_filter_default();
  f.what = 99;
  EXPECT_EQ(request(&s, d, 1, &f), DFM_E_ARG);
  test::says({"what is 99"});
  hits.out = nullptr;
  EXPECT_EQ(request(&s, d, 1), DFM_E_ARG);
  test::says({"out is NULL", "capacity of 4"});
  hits.size = 8;
  EXPECT_EQ(request(&s, d, 1), DFM_E_ARG);
  EXPECT_EQ(hits.n, 77u) << "untouched";
  struct Newer {
    dfm_query_hits known;
    uint64_t more;
  } newer{{sizeof newer, sizeof rows[0], 4, 0, rows}, 0};
  test::ok(dfm_world_query(y.world, &s, d, 1, nullptr, nullptr, &newer));
  newer.more = 1;
  EXPECT_EQ(dfm_world_query(y.world, &s, d, 1, nullptr, nullptr, &newer), DFM_E_UNSUPPORTED);
  EXPECT_EQ(dfm_world_query(y.world, &s, d, 1, nullptr, nullptr, nullptr), DFM_E_ARG);
  EXPECT_EQ(dfm_world_query(12345, &s, d, 1, nullptr, nullptr, &hits), DFM_E_HANDLE);
}
