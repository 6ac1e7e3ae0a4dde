// Untangling: what overlaps is moved apart before the first step, without energy and without speed; what
// cannot be parted is named and stays.
#include <algorithm>

#include "logged_context.h"
#include "obstacle.h"
#include "world.h"

namespace {

dfm_world untangling(dfm_context *c, std::array<double, 3> gravity = {}) {
  dfm_world_def d = dfm_world_def_default();
  for (int k = 0; k < 3; ++k) d.gravity[k] = gravity[k];
  d.flags = DFM_WORLD_UNTANGLE;
  dfm_world w = 0;
  test::ok(dfm_world_create(c, &d, &w));
  return w;
}

dfm_body ball(dfm_context *c, dfm_world w, std::array<double, 3> at, double radius = 0.1,
              uint32_t cells = 1000, double density = 1000) {
  test::BodyOptions o;
  o.position = at;
  o.damping_stiffness = 1e-3;
  o.density = density;
  return test::make_body(c, w, "ball", {radius, 0, 0}, cells, o);
}

std::vector<dfm_overlap> overlaps(dfm_world w) { return test::listed(dfm_world_overlaps, w); }
size_t left(dfm_world w) {
  uint32_t n = 0;
  test::ok(dfm_world_find_overlaps(w, &n));
  return n;
}
double distance(const dfm_body_measure &a, const dfm_body_measure &b) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) sum += (a.com[k] - b.com[k]) * (a.com[k] - b.com[k]);
  return std::sqrt(sum);
}

void hold_all(dfm_body b) {
  uint32_t n = 0;
  test::ok(dfm_body_get_state(b, 0, nullptr, nullptr, &n));
  std::vector<uint32_t> points(n);
  for (uint32_t i = 0; i < n; ++i) points[i] = i;
  test::ok(dfm_body_hold(b, n, points.data(), 7));
}

// Apart, as they were made, at rest: no elastic energy, no speed then and after.
void expect_calm(dfm_world w, std::initializer_list<dfm_body> bodies) {
  test::run(w, 0.05, 1e-3);
  for (const dfm_body b : bodies) {
    const dfm_body_measure m = test::measure(b);
    EXPECT_LT(m.speed_max, 1e-9);
    EXPECT_LT(m.elastic, 1e-15);
  }
}

}  // namespace

TEST(Untangle, TwoBallsAtAnyDistance_ComeApartWithoutSpeed) {
  for (const double apart : {0.0, 0.05, 0.1, 0.15, 0.19}) {
    test::Context c;
    const dfm_world w = untangling(c);
    const dfm_body a = ball(c, w, {}), b = ball(c, w, {0.6 * apart, 0.8 * apart, 0});
    const auto found = overlaps(w);
    ASSERT_EQ(found.size(), 1u) << apart;
    EXPECT_EQ(found[0].flags, uint32_t{DFM_OVERLAP_SEPARATED}) << apart;
    EXPECT_EQ(left(w), 0u) << apart;
    const dfm_body_measure ma = test::measure(a), mb = test::measure(b);
    EXPECT_LT(distance(ma, mb), 0.205) << apart;
    for (int k = 0; k < 3; ++k)  // their common center stays
      EXPECT_NEAR(ma.com[k] + mb.com[k], (k == 0 ? 0.6 : k == 1 ? 0.8 : 0) * apart, 1e-4) << apart;
    uint32_t trouble = 0;
    test::ok(dfm_world_step(w, 1e-3, &trouble));
    EXPECT_FALSE(trouble & DFM_TROUBLE_OVERLAP);
    expect_calm(w, {a, b});
    dfm_world_destroy(w);
  }
}

TEST(Untangle, BodyInsideBody_ComesOut) {
  test::Context c;
  const dfm_world w = untangling(c);
  const dfm_body a = ball(c, w, {}), b = ball(c, w, {0.02, 0.01, 0}, 0.03, 200);
  EXPECT_EQ(overlaps(w).size(), 1u);
  EXPECT_EQ(left(w), 0u);
  EXPECT_LT(distance(test::measure(a), test::measure(b)), 0.14);
  expect_calm(w, {a, b});
  dfm_world_destroy(w);
}

TEST(Untangle, BodyInEveryShapeOfObstacle_ComesOut) {
  for (const double size : {0.03, 0.3})  // inside the body; around it
    for (const uint32_t shape : {DFM_SHAPE_PLANE, DFM_SHAPE_SPHERE, DFM_SHAPE_BOX, DFM_SHAPE_CAPSULE,
                                 DFM_SHAPE_MESH, DFM_SHAPE_VOXELS}) {
      test::Context c;
      const dfm_world w = untangling(c);
      const dfm_body b = ball(c, w, {0.01, 0.02, -0.01}, 0.1, 400);
      const test::Triangles t = test::box_surface({size, size, size}, 1);
      dfm_obstacle_def d = dfm_obstacle_def_default();
      d.shape = shape;
      d.radius = d.half_length = d.half_size[0] = d.half_size[1] = d.half_size[2] = size;
      if (shape == DFM_SHAPE_MESH || shape == DFM_SHAPE_VOXELS) {
        d.npoint = 8;
        d.points = t.points.data();
        d.ntriangle = 12;
        d.triangles = t.tris.data();
        d.cells = 32768;
      }
      dfm_obstacle o = 0;
      test::ok(dfm_obstacle_create(w, &d, &o));
      EXPECT_EQ(overlaps(w).size(), 1u) << shape << ' ' << size;
      EXPECT_EQ(left(w), 0u) << shape << ' ' << size;
      EXPECT_LT(std::abs(test::measure(b).com[0]) + std::abs(test::measure(b).com[1]) +
                    std::abs(test::measure(b).com[2]),
                2.5 * (size + 0.1));
      expect_calm(w, {b});
      dfm_world_destroy(w);
    }
}

TEST(Untangle, HeapInACorner_ComesApartAndFallsToRest) {
  test::Context c;
  const dfm_world w = untangling(c, {0, 0, -9.81});
  test::add_plane(w, "floor");
  const double s = std::sqrt(0.5);
  test::add_plane(w, "wall", {-0.15, 0, 0}, {0, s, 0, s});
  std::vector<dfm_body> all;
  for (int i = 0; i < 8; ++i)
    all.push_back(ball(c, w, {0.05 * (i % 2), 0.04 * (i / 2 % 2), 0.05 + 0.05 * (i / 4)}, 0.05, 60));
  EXPECT_GT(overlaps(w).size(), 8u);
  EXPECT_EQ(left(w), 0u);
  test::run(w, 0.3, 1e-3);
  for (const dfm_body b : all) EXPECT_LT(test::measure(b).speed_max, 4.0);  // free fall over 0.3 s: 2.9 m/s
  EXPECT_EQ(left(w), 0u);
  dfm_world_destroy(w);
}

TEST(Untangle, WhatWasApartedIsGuarded_FromThenOn) {
  test::Context c;
  const dfm_world w = untangling(c);
  const dfm_body a = ball(c, w, {}, 0.05, 200), b = ball(c, w, {0.05, 0, 0}, 0.05, 200);
  EXPECT_EQ(overlaps(w).size(), 1u);
  test::set_velocity(a, {5, 0, 0});
  test::set_velocity(b, {-5, 0, 0});
  for (int i = 0; i < 20; ++i) {
    test::ok(dfm_world_step(w, 1e-3, nullptr));
    ASSERT_EQ(left(w), 0u) << i;
  }
  EXPECT_LT(test::measure(a).velocity[0], 0);
  dfm_world_destroy(w);
}

TEST(Untangle, HeldBodyStaysAndTheOtherGoes_TwoHeldOnesAreNamed) {
  for (const bool both : {false, true}) {
    test::LoggedContext logged;
    dfm_context *const c = logged.context;
    const dfm_world w = untangling(c);
    const dfm_body a = ball(c, w, {}), b = ball(c, w, {0.1, 0, 0});
    hold_all(a);
    if (both) hold_all(b);
    const auto found = overlaps(w);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ((found[0].flags & DFM_OVERLAP_SEPARATED) == 0, both);
    EXPECT_NEAR(test::measure(a).com[0], 0, 1e-9);
    if (both) {
      EXPECT_NE(logged.log.find("untangle cannot separate"), std::string::npos) << logged.log;
    }
    EXPECT_EQ(logged.log.find("set \"untangle\""), std::string::npos) << "it is set\n" << logged.log;
    if (!both) {
      EXPECT_GT(test::measure(b).com[0], 0.19);
    }
    uint32_t trouble = 0;
    test::ok(dfm_world_step(w, 1e-3, &trouble));
    EXPECT_EQ((trouble & DFM_TROUBLE_OVERLAP) != 0, both);
    dfm_world_destroy(w);
  }
}

TEST(Untangle, BodyLargerThanItsRoom_StaysAndIsNamed) {
  test::LoggedContext logged;
  dfm_context *const c = logged.context;
  const dfm_world w = untangling(c);
  const dfm_body b = ball(c, w, {}, 0.1, 400);
  test::add_mesh(w, "room", test::inside_out(test::box_surface({0.08, 0.08, 0.08}, 1)));
  ASSERT_EQ(overlaps(w).size(), 1u);
  EXPECT_FALSE(overlaps(w)[0].flags & DFM_OVERLAP_SEPARATED);
  EXPECT_NEAR(test::measure(b).com[0], 0, 1e-9);
  EXPECT_NE(logged.log.find("untangle cannot separate"), std::string::npos) << logged.log;
  test::run(w, 0.02, 1e-3);
  EXPECT_LT(test::measure(b).speed_max, 1);
  dfm_world_destroy(w);
}

// A large ball between two planes that are too close for it; where it goes to and fro, a small one has room
// beside it, out of a held one.
TEST(Untangle, BodyThatGoesBack_FindsNoOtherInItsPlace) {
  test::Context c;
  const dfm_world w = untangling(c);
  const std::array<double, 3> n{std::sqrt(1 - 0.09), 0, 0.3};
  ball(c, w, {0, 0, 0.15}, 0.2);
  ball(c, w, {0.231 * n[0], 0, 0.15 + 0.231 * n[2]}, 0.03);
  hold_all(ball(c, w, {0.283 * n[0], 0, 0.15 + 0.283 * n[2]}, 0.03));
  dfm_obstacle_def plane = dfm_obstacle_def_default();
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w, &plane, &o));
  plane.pose = {{0, 0, 0.3}, {1, 0, 0, 0}};
  test::ok(dfm_obstacle_create(w, &plane, &o));
  const auto found = overlaps(w);
  ASSERT_EQ(found.size(), 3u) << "with each plane, and the small one with the held one";
  left(w);
  for (const dfm_overlap &now : overlaps(w))
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&](const dfm_overlap &f) {
      return f.a == now.a && f.b == now.b;
    })) << "two that did not overlap before";
  dfm_world_destroy(w);
}

TEST(Untangle, ByCall_PartsWhatIsAsideAndTakesItBack) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  const dfm_body a = ball(c, w, {}), b = ball(c, w, {0.1, 0, 0});
  test::run(w, 0.01, 1e-3);
  EXPECT_EQ(overlaps(w).size(), 1u);
  uint32_t n = 1;
  test::ok(dfm_world_untangle(w, &n));
  EXPECT_EQ(n, 0u);
  EXPECT_EQ(left(w), 0u);
  test::set_velocity(a, {1, 0, 0});
  test::run(w, 0.1, 1e-3);
  EXPECT_GT(test::measure(b).velocity[0], 0.3);
  dfm_world_destroy(w);
}
