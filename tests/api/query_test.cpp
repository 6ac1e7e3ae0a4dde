// Overlaps, casts, all hits of a ray and closest points with filters, through the public API.
#include <algorithm>
#include <cstring>
#include <thread>

#include "heap_calls.h"
#include "obstacle.h"
#include "rigid.h"
#include "stack.h"

namespace {

using Vec = std::array<double, 3>;

dfm_query_shape sphere(Vec at, double r) {
  dfm_query_shape s = dfm_query_shape_default();
  s.radius = r;
  std::copy(at.begin(), at.end(), s.pose.position);
  return s;
}
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
  uint64_t things[16];
  uint32_t n = 0;
  test::ok(dfm_world_query_overlap(w, &s, f, 16, things, &n));
  return {things, things + n};
}
dfm_query_hit cast(dfm_world w, const dfm_query_shape &s, Vec path, const dfm_query_filter *f = nullptr) {
  dfm_query_hit hit{};
  hit.size = sizeof hit;
  test::ok(dfm_world_query_cast(w, &s, path.data(), f, &hit));
  return hit;
}
std::vector<dfm_query_hit> all_hits(dfm_world w, Vec o, Vec d, double most = 100, uint32_t capacity = 64,
                                    const dfm_query_filter *f = nullptr) {
  std::vector<dfm_query_hit> out(capacity);
  uint32_t n = 0;
  test::ok(dfm_world_query_ray_all(w, o.data(), d.data(), most, f, capacity, out.data(), &n));
  out.resize(std::min(n, capacity));
  return out;
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
  const dfm_aabb aabb{{0.9, -0.1, 0.9}, {2.1, 0.1, 1.1}};
  uint64_t things[1] = {77};
  uint32_t n = 0;
  test::ok(dfm_world_query_aabb(y.world, &aabb, nullptr, 1, things, &n));
  EXPECT_EQ(n, 2u) << "ball and crate; there is room for one";
  EXPECT_EQ(things[0], y.ball);
}

TEST(QueryOverlap, TrianglesOfABody_AreThoseOfTheShapesPlace) {
  test::Context c;
  const Yard y(c);
  dfm_body_info info{};
  test::ok(dfm_body_get_info(y.lower, &info));
  std::vector<uint32_t> list(info.ntriangle);
  uint32_t n = 0;
  const dfm_query_shape all = sphere({0.05, 0.05, 0.05}, 1);
  test::ok(dfm_body_query_triangles(y.lower, &all, info.ntriangle, list.data(), &n));
  EXPECT_EQ(n, info.ntriangle);
  EXPECT_TRUE(std::is_sorted(list.begin(), list.end()));
  const dfm_query_shape side = box({0, 0.05, 0.05}, {0.001, 0.2, 0.2});
  test::ok(dfm_body_query_triangles(y.lower, &side, info.ntriangle, list.data(), &n));
  EXPECT_GT(n, 0u);
  EXPECT_LT(n, info.ntriangle);
  std::vector<double> x(3 * info.nsurfel);
  std::vector<uint32_t> tri(3 * info.ntriangle);
  test::ok(dfm_surface_positions(y.lower, info.nsurfel, x.data(), nullptr));
  test::ok(dfm_surface_triangles(y.lower, info.ntriangle, tri.data(), nullptr));
  for (uint32_t i = 0; i < n; ++i) {
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
  struct Asked {
    Things things;
    uint64_t not_this;
  } asked{{}, y.crate};
  f.user = &asked;
  f.accept = [](void *user, uint64_t thing) {
    Asked &a = *static_cast<Asked *>(user);
    a.things.push_back(thing);
    return thing != a.not_this;
  };
  f.what = DFM_QUERY_OBSTACLES;
  f.collides_with = 3;
  EXPECT_EQ(overlaps(y.world, all, &f), (Things{y.floor, y.ball, y.mesh}));
  EXPECT_EQ(asked.things, (Things{y.floor, y.ball, y.crate, y.mesh})) << "once each, in order of creation";
  const dfm_query_hit hit = cast(y.world, sphere({1.5, 0, 1}, 0.1), {5, 0, 0}, &f);
  EXPECT_EQ(hit.thing, y.mesh) << "the crate is refused, the pill masked";
  EXPECT_NEAR(hit.distance, 4 - 0.1 - 0.1 - 1.5, 1e-8);
}

TEST(QueryFilter, ACallbackThatChangesTheWorld_IsRefused) {
  test::Context c;
  const Yard y(c);
  dfm_query_filter f = dfm_query_filter_default();
  struct Asked {
    dfm_world w;
    dfm_body b;
    int refused;
  } asked{y.world, y.upper, 0};
  f.user = &asked;
  f.accept = [](void *user, uint64_t) {
    Asked &a = *static_cast<Asked *>(user);
    a.refused += dfm_body_destroy(a.b) == DFM_E_BUSY;
    a.refused += dfm_world_step(a.w, 1e-3, nullptr) == DFM_E_BUSY;
    test::says({"busy with another call"});
    return true;
  };
  EXPECT_EQ(overlaps(y.world, sphere({0, 0, 0}, 20), &f).size(), 7u);
  EXPECT_EQ(asked.refused, 14);
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
  uint32_t n = 0;
  const Vec o{-1, 0.013, 1.007}, d{1, 0, 0};
  test::ok(dfm_world_query_ray_all(y.world, o.data(), d.data(), 100, nullptr, 0, nullptr, &n));
  EXPECT_EQ(n, 8u);
  EXPECT_EQ(all_hits(y.world, o, d, 3.05).size(), 3u) << "up to max_distance";
  EXPECT_EQ(all_hits(y.world, {2, 0, 1}, d, 1).size(), 2u) << "from within: out of the crate, into the pill";
  const std::vector<dfm_query_hit> down = all_hits(y.world, {0.061, 0.047, 5}, {0, 0, -1});
  ASSERT_EQ(down.size(), 5u);
  EXPECT_EQ(down[0].thing, y.upper);
  EXPECT_EQ(down[4].thing, y.floor);
  dfm_query_hit first{};
  first.size = sizeof first;
  test::ok(dfm_world_query_ray(y.world, o.data(), d.data(), 100, nullptr, &first));
  EXPECT_EQ(first.distance, hits[0].distance);
}

TEST(QueryRay, RowsOfANewerHeader_HaveZeroBehind) {
  test::Context c;
  const Yard y(c);
  const Vec o{-1, 0.013, 1.007}, d{1, 0, 0};
  constexpr uint32_t row = sizeof(dfm_query_hit) + 16;
  std::vector<unsigned char> out(9 * row, 0xa5);
  uint32_t n = 0;
  test::ok(dfm_world_query_ray_all_sized(y.world, o.data(), d.data(), 100, nullptr, row, 8,
                                         reinterpret_cast<dfm_query_hit *>(out.data()), &n));
  double last = 0;
  for (uint32_t i = 0; i < 8; ++i) {
    dfm_query_hit h;
    std::memcpy(&h, &out[i * row], sizeof h);
    EXPECT_GT(h.distance, last);
    last = h.distance;
    for (uint32_t k = sizeof h; k < row; ++k) EXPECT_EQ(out[i * row + k], 0);
  }
  for (uint32_t k = 8 * row; k < 9 * row; ++k) EXPECT_EQ(out[k], 0xa5);
  EXPECT_EQ(dfm_world_query_ray_all_sized(y.world, o.data(), d.data(), 100, nullptr, 72, 0, nullptr, &n),
            DFM_E_ARG);
  test::says({"row_size 72", "sizeof(dfm_query_hit)"});
}

TEST(QueryClosest, IsTheNearestSurfaceOfAnyKind) {
  test::Context c;
  const Yard y(c);
  const auto closest = [&](Vec p, double most = 10, const dfm_query_filter *f = nullptr) {
    dfm_query_hit hit{};
    hit.size = sizeof hit;
    test::ok(dfm_world_query_closest(y.world, p.data(), most, f, &hit));
    return hit;
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
  dfm_query_shape s = sphere({0, 0, 0}, 1);
  uint32_t n = 0;
  EXPECT_EQ(dfm_body_query_triangles(y.upper, &s, 0, nullptr, &n), DFM_E_HANDLE);
}

TEST(Query, OnSeveralThreads_GivesTheBitsOfOneAndTakesNoMemory) {
  test::Context c;
  const Yard y(c);
  test::ok(dfm_world_step(y.world, 1e-3, nullptr));
  struct Answers {
    std::vector<double> numbers;
    void ask(dfm_world w) {
      numbers.clear();
      for (int i = 0; i < 60; ++i) {
        const double at = -0.5 + 0.08 * i;
        dfm_query_hit h{};
        h.size = sizeof h;
        dfm_query_shape s = sphere({at, 0.02, 1.5}, 0.05);
        s.shape = i % 3 == 0 ? DFM_SHAPE_BOX : DFM_SHAPE_CAPSULE;
        s.half_length = s.half_size[0] = 0.04;
        const double path[3] = {0.1 * (i % 5), 0.01, -2};
        test::ok(dfm_world_query_cast(w, &s, path, nullptr, &h));
        for (const double x : {h.distance, h.point[0], h.normal[1], double(h.triangle)}) numbers.push_back(x);
        const double p[3] = {at, 0.1, 0.3};
        test::ok(dfm_world_query_closest(w, p, 10, nullptr, &h));
        numbers.push_back(h.distance);
        uint64_t things[8];
        uint32_t n = 0;
        test::ok(dfm_world_query_overlap(w, &s, nullptr, 8, things, &n));
        dfm_query_hit rows[8];
        numbers.push_back(n);
        test::ok(dfm_world_query_ray_all(w, p, path, 10, nullptr, 8, rows, &n));
        numbers.push_back(n);
        for (uint32_t k = 0; k < std::min(n, 8u); ++k) numbers.push_back(rows[k].distance);
      }
    }
  };
  Answers one[4];
  for (Answers &a : one) a.numbers.reserve(4096);
  std::vector<std::thread> threads;
  for (int t = 1; t < 4; ++t) threads.emplace_back([&, t] { one[t].ask(y.world); });
  one[0].ask(y.world);
  for (std::thread &t : threads) t.join();
  for (int t = 1; t < 4; ++t) EXPECT_EQ(one[t].numbers, one[0].numbers);
  const uint64_t heap = test::heap_calls;
  one[0].ask(y.world);
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
  const Vec o{0, 0, 0}, d{1, 0, 0};
  uint32_t n = 77;
  uint64_t things[4];
  const auto refused = [&](const dfm_query_shape &s, std::initializer_list<const char *> parts) {
    EXPECT_EQ(dfm_world_query_overlap(y.world, &s, nullptr, 4, things, &n), DFM_E_ARG);
    test::says(parts);
    dfm_query_hit hit{};
    EXPECT_EQ(dfm_world_query_cast(y.world, &s, d.data(), nullptr, &hit), DFM_E_ARG);
  };
  refused(sphere({0, 0, 0}, -1), {"radius", "-1"});
  refused(sphere({NAN, 0, 0}, 1), {"position", "nan"});
  refused(sphere({0, 0, 0}, INFINITY), {"radius"});
  refused(box({0, 0, 0}, {1, NAN, 1}), {"half_size"});
  dfm_query_shape s = sphere({0, 0, 0}, 1);
  s.shape = DFM_SHAPE_PLANE;
  refused(s, {"shape 0", "DFM_SHAPE_CONVEX"});
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
  EXPECT_EQ(n, 77u) << "untouched";
  dfm_query_hit hit{};
  EXPECT_EQ(dfm_world_query_ray(y.world, o.data(), o.data(), 1, nullptr, &hit), DFM_E_ARG);
  EXPECT_EQ(dfm_world_query_ray(y.world, o.data(), d.data(), 0, nullptr, &hit), DFM_E_ARG);
  EXPECT_EQ(dfm_world_query_ray(y.world, nullptr, d.data(), 1, nullptr, &hit), DFM_E_ARG);
  EXPECT_EQ(dfm_world_query_ray(y.world, o.data(), d.data(), 1, nullptr, nullptr), DFM_E_ARG);
  EXPECT_EQ(dfm_world_query_closest(y.world, o.data(), NAN, nullptr, &hit), DFM_E_ARG);
  EXPECT_EQ(dfm_world_query_overlap(y.world, nullptr, nullptr, 4, things, &n), DFM_E_ARG);
  s = sphere({0, 0, 0}, 1);
  EXPECT_EQ(dfm_world_query_overlap(y.world, &s, nullptr, 4, nullptr, &n), DFM_E_ARG);
  dfm_query_filter f = dfm_query_filter_default();
  f.what = 99;
  EXPECT_EQ(dfm_world_query_overlap(y.world, &s, &f, 4, things, &n), DFM_E_ARG);
  test::says({"what is 99"});
  const dfm_aabb turned{{0, 0, 0}, {1, -1, 1}};
  EXPECT_EQ(dfm_world_query_aabb(y.world, &turned, nullptr, 4, things, &n), DFM_E_ARG);
  test::says({"lo[1]"});
  EXPECT_EQ(dfm_world_query_overlap(12345, &s, nullptr, 4, things, &n), DFM_E_HANDLE);
}
