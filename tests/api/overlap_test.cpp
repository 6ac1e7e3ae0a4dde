// Things that are through each other when they are made or put somewhere: found, named, listed; and what the
// steps after cost and do.
#include <cmath>
#include <cstring>

#include "logged_context.h"
#include "obstacle.h"
#include "world.h"

namespace {

dfm_body ball(dfm_context *c, dfm_world w, const char *name, std::array<double, 3> at, double radius = 0.1,
              uint32_t cells = 1000) {
  test::BodyOptions o;
  o.name = name;
  o.position = at;
  o.damping_stiffness = 1e-3;
  return test::make_body(c, w, "ball", {radius, 0, 0}, cells, o);
}

std::vector<dfm_overlap> overlaps(dfm_world w) { return test::listed(dfm_world_overlaps, w); }

dfm_obstacle thing(dfm_world w, uint32_t shape, double size, const test::Triangles *t = nullptr) {
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = "thing";
  d.shape = shape;
  d.radius = size;
  d.half_length = size;
  for (double &h : d.half_size) h = size;
  if (t) {
    d.npoint = uint32_t(t->points.size() / 3);
    d.points = t->points.data();
    d.ntriangle = uint32_t(t->tris.size() / 3);
    d.triangles = t->tris.data();
  }
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w, &d, &o));
  return o;
}

}  // namespace

TEST(Overlap, OfTwoBalls_IsFoundNamedAndReportedOnce) {
  test::LoggedContext logged;
  dfm_context *const c = logged.context;
  const dfm_world w = test::make_world(c, {});
  const dfm_body a = ball(c, w, "left", {}), b = ball(c, w, "right", {0.15, 0, 0});
  uint32_t trouble = 0;
  ASSERT_EQ(dfm_world_step(w, 1e-3, &trouble), DFM_OK) << dfm_last_error();
  EXPECT_TRUE(trouble & DFM_TROUBLE_OVERLAP);
  const auto found = overlaps(w);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].a, a);
  EXPECT_EQ(found[0].b, b);
  EXPECT_GT(found[0].crossings, 10u);
  EXPECT_GT(found[0].enclosed, 10u);
  EXPECT_NEAR(found[0].depth, 0.05, 0.005);
  EXPECT_NE(logged.log.find("body 'left' and body 'right' overlap by"), std::string::npos) << logged.log;
  ASSERT_EQ(dfm_world_step(w, 1e-3, &trouble), DFM_OK);
  EXPECT_FALSE(trouble & DFM_TROUBLE_OVERLAP);
  dfm_world_destroy(w);
}

TEST(Overlap, OfTwoBallsAtAnyDistance_ThrowsNothingAndSolvesNothing) {
  for (const double apart : {0.0, 1e-9, 0.05, 0.1, 0.15}) {
    test::Context c;
    const dfm_world w = test::make_world(c, {});
    const dfm_body a = ball(c, w, "a", {}), b = ball(c, w, "b", {apart, 0, 0});
    for (int i = 0; i < 100; ++i) ASSERT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK) << dfm_last_error();
    EXPECT_LT(test::measure(a).speed_max, 1e-9) << apart;
    EXPECT_LT(test::measure(b).speed_max, 1e-9) << apart;
    EXPECT_EQ(test::stats(w).contacts_max, 0u) << apart;
    EXPECT_EQ(overlaps(w).size(), 1u) << apart;
    dfm_world_destroy(w);
  }
}

TEST(Overlap, OfPairThatSeparates_HasContactAfterwards) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  const dfm_body a = ball(c, w, "a", {}), b = ball(c, w, "b", {0.15, 0, 0});
  test::set_velocity(a, {-1, 0, 0});
  test::run(w, 0.1, 1e-3);  // 0.25 apart
  uint32_t n = 1;
  test::ok(dfm_world_find_overlaps(w, &n));
  EXPECT_EQ(n, 0u);
  test::set_velocity(a, {1, 0, 0});
  test::run(w, 0.1, 1e-3);
  EXPECT_GT(test::measure(b).velocity[0], 0.3);
  dfm_world_destroy(w);
}

TEST(Overlap, OfTouchingBodies_IsNone) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  test::BodyOptions o;
  o.name = "low";
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 300, o);
  o.name = "high";
  o.position = {0.013, 0.007, 0.1};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 300, o);
  test::add_plane(w, "floor");
  uint32_t trouble = 0;
  ASSERT_EQ(dfm_world_step(w, 1e-3, &trouble), DFM_OK);
  EXPECT_FALSE(trouble & DFM_TROUBLE_OVERLAP);
  EXPECT_TRUE(overlaps(w).empty());
  dfm_world_destroy(w);
}

TEST(Overlap, OfCubesOnOneGrid_IsFoundThoughNoEdgeCrosses) {
  for (const double shift : {0.0, 0.05}) {
    test::Context c;
    const dfm_world w = test::make_world(c, {});
    test::BodyOptions o;
    o.name = "a";
    test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 40, o);
    o.name = "b";
    o.position = {shift, 0, 0};
    test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 40, o);
    EXPECT_EQ(overlaps(w).size(), 1u) << shift;
    test::run(w, 0.02, 1e-3);
    dfm_world_destroy(w);
  }
}

TEST(Overlap, OfBodyWithEveryShapeOfObstacle_IsFound) {
  const test::Triangles box = test::box_surface({0.03, 0.03, 0.03}, 1);
  const test::Triangles large = test::box_surface({0.5, 0.5, 0.5}, 1);
  for (const bool around : {false, true})  // the obstacle holds the body, or lies inside it
    for (const uint32_t shape :
         {DFM_SHAPE_SPHERE, DFM_SHAPE_BOX, DFM_SHAPE_CAPSULE, DFM_SHAPE_MESH, DFM_SHAPE_VOXELS}) {
      test::Context c;
      const dfm_world w = test::make_world(c, {});
      ball(c, w, "ball", {0.01, 0.002, 0.003});
      thing(w, shape, around ? 0.5 : 0.03,
            shape == DFM_SHAPE_MESH || shape == DFM_SHAPE_VOXELS ? (around ? &large : &box) : nullptr);
      const auto found = overlaps(w);
      ASSERT_EQ(found.size(), 1u) << shape << around;
      EXPECT_TRUE(found[0].flags & DFM_OVERLAP_OBSTACLE);
      EXPECT_GT(found[0].depth, 0.01) << shape << around;
      dfm_world_destroy(w);
    }
}

TEST(Overlap, OfBodyWithAMeshInMillimeters_NamesTheUnits) {
  for (const double size : {50.0, 0.05}) {
    test::LoggedContext logged;
    const dfm_world w = test::make_world(logged.context, {});
    ball(logged.context, w, "ball", {});
    const test::Triangles box = test::box_surface({size, size, size}, 1);
    thing(w, DFM_SHAPE_MESH, 0, &box);
    uint32_t trouble = 0;
    ASSERT_EQ(dfm_world_step(w, 1e-3, &trouble), DFM_OK) << dfm_last_error();
    EXPECT_NE(logged.log.find("overlap by"), std::string::npos) << logged.log;
    EXPECT_EQ(logged.log.find("if a mesh is in millimeters") != std::string::npos, size > 1) << logged.log;
  }
}

TEST(Overlap, OfBodyWithPlane_IsLedOutSlowly) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  const dfm_body b = ball(c, w, "ball", {0, 0, 0.08});
  test::add_plane(w, "floor");
  ASSERT_EQ(overlaps(w).size(), 1u);
  EXPECT_NEAR(overlaps(w)[0].depth, 0.02, 0.002);
  test::run(w, 0.5, 1e-3);
  EXPECT_LT(test::measure(b).speed_max, 0.05);
  dfm_world_destroy(w);
}

TEST(Overlap, OfBodyInsideBody_IsFoundAndOfBodyInRoomIsNot) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  ball(c, w, "large", {});
  ball(c, w, "small", {0.01, 0, 0}, 0.03, 300);
  const auto found = overlaps(w);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].crossings, 0u);
  EXPECT_GT(found[0].enclosed, 50u);
  const test::Triangles room = test::inside_out(test::box_surface({0.5, 0.5, 0.5}, 1));
  thing(w, DFM_SHAPE_MESH, 0, &room);
  const auto still = overlaps(w);  // what no step has reported, and nothing with the room
  ASSERT_EQ(still.size(), 1u);
  EXPECT_EQ(still[0].b, found[0].b);
  dfm_world_destroy(w);
}

namespace {

// A cube on one of its edges, filled with coarse cells, which reach out of its surface.
// `along` is the place of its center along the normal of a face.
dfm_pose tilted(double along) {
  const double at = along / std::sqrt(2.0), half = 3.14159265358979323846 / 8;
  return {{at, 0, at}, {0, std::sin(half), 0, std::cos(half)}};
}
dfm_body filled_cube(dfm_context *c, dfm_world w, const char *name, double along) {
  const double size[3] = {0.2, 0.2, 0.2};
  dfm_mesh_handle skin = 0;
  dfm_mesh_handle mesh = 0;
  test::ok(dfm_mesh_make(c, "beam", size, DFM_MESH_SURFACE, 400, &skin));
  test::ok(dfm_mesh_fill(skin, 100, &mesh));
  dfm_body_def d = dfm_body_def_default();
  d.cell_share = test::lend(mesh, d).share;
  dfm_surface_def s = {};
  s.size = sizeof s;
  const dfm_mesh_info info = test::info_of(skin);
  s.points = info.points;
  s.triangles = info.faces;
  s.npoint = info.npoint;
  s.ntriangle = info.ntriangle;
  d.surface = &s;
  d.name = name;
  d.pose = tilted(along);
  dfm_body b = 0;
  test::ok(dfm_body_create(w, &d, &b));
  test::ok(dfm_mesh_destroy(mesh));
  test::ok(dfm_mesh_destroy(skin));
  return b;
}

}  // namespace

TEST(Overlap, OfFilledBodiesSideBySide_IsNoneThoughTheirCellsReachOut) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  const dfm_body low = filled_cube(c, w, "low", 0);
  const dfm_body high = filled_cube(c, w, "high", 0.203);
  const test::Triangles box = test::box_surface({0.1, 0.1, 0.1}, 2);
  const dfm_obstacle o = thing(w, DFM_SHAPE_MESH, 0, &box);
  const dfm_pose below = tilted(-0.203);
  test::ok(dfm_obstacle_teleport(o, &below));
  EXPECT_EQ(overlaps(w).size(), 0u);
  test::set_velocity(high, {-0.7, 0, -0.7});
  test::run(w, 0.05, 1e-3);
  EXPECT_LT(test::measure(low).velocity[2], -0.2);
  EXPECT_EQ(overlaps(w).size(), 0u);
  dfm_world_destroy(w);
}

TEST(Overlap, OfFilledBodiesInOnePlace_IsFound) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  filled_cube(c, w, "a", 0);
  filled_cube(c, w, "b", 0);
  EXPECT_EQ(overlaps(w).size(), 1u);
  dfm_world_destroy(w);
}

TEST(Overlap, AfterSetStateAndRestore_IsFound) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  ball(c, w, "a", {});
  const dfm_body b = ball(c, w, "b", {0.3, 0, 0});
  test::run(w, 0.01, 1e-3);
  EXPECT_TRUE(overlaps(w).empty());
  auto [x, v] = test::State(b);
  const uint32_t n = uint32_t(x.size() / 3);
  for (size_t i = 0; i < x.size(); i += 3) x[i] -= 0.2;
  test::ok(dfm_body_set_state(b, n, x.data(), nullptr));
  uint32_t trouble = 0;
  ASSERT_EQ(dfm_world_step(w, 1e-3, &trouble), DFM_OK);
  EXPECT_TRUE(trouble & DFM_TROUBLE_OVERLAP);
  ASSERT_EQ(overlaps(w).size(), 1u);

  const std::string kept = test::snapshot(w);
  const dfm_world other = test::make_world(c, {});
  ball(c, other, "a", {});
  ball(c, other, "b", {0.3, 0, 0});
  test::ok(dfm_world_restore(other, kept.data(), kept.size()));
  EXPECT_EQ(overlaps(other).size(), 1u);
  for (int i = 0; i < 20; ++i) {
    test::ok(dfm_world_step(w, 1e-3, nullptr));
    test::ok(dfm_world_step(other, 1e-3, nullptr));
    ASSERT_EQ(dfm_world_hash(w), dfm_world_hash(other)) << i;
  }
  dfm_world_destroy(w);
  dfm_world_destroy(other);
}

TEST(Overlap, OfFilteredPair_DoesNotCount) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  ball(c, w, "a", {});
  ball(c, w, "b", {0.1, 0, 0});
  test::ok(dfm_world_filter_pair(w, "a", "b", false));
  EXPECT_TRUE(overlaps(w).empty());
  test::ok(dfm_world_filter_pair(w, "a", "b", true));
  EXPECT_EQ(overlaps(w).size(), 1u);
  dfm_world_destroy(w);
}

TEST(Overlap, InAStepThatIsInterrupted_IsToldByTheNext) {
  test::Context c;
  dfm_world w = test::make_world(c, {});
  test::add_plane(w, "floor", {0, 0, -0.1});
  ball(c, w, "a", {}, 0.1, 200);
  ball(c, w, "b", {0.15, 0, 0}, 0.1, 200);
  const auto stop = [](void *user, dfm_contact_choice *) {
    test::ok(dfm_world_interrupt(*static_cast<dfm_world *>(user)));
  };
  test::ok(dfm_world_set_pre_solve(w, stop, &w));
  ASSERT_EQ(dfm_world_step(w, 1e-5, nullptr), DFM_DISCARD);
  test::ok(dfm_world_set_pre_solve(w, nullptr, nullptr));
  uint32_t trouble = 0;
  test::ok(dfm_world_step(w, 1e-5, &trouble));
  EXPECT_TRUE(trouble & DFM_TROUBLE_OVERLAP);
  dfm_world_destroy(w);
}

// What the host has excluded while the pair was set aside remains so when the two are apart.
TEST(Overlap, OfPairExcludedWhileSetAside_HasNoContactAfterwards) {
  for (const bool by_masks : {false, true}) {
    test::Context c;
    const dfm_world w = test::make_world(c, {});
    test::add_plane(w, "floor", {0, 0, -1});
    const dfm_body a = ball(c, w, "a", {}, 0.1, 200), b = ball(c, w, "b", {0.15, 0, 0}, 0.1, 200);
    test::run(w, 1e-3, 1e-3);
    ASSERT_EQ(overlaps(w).size(), 1u);
    if (by_masks) {
      test::ok(dfm_body_set_filter(a, 1, 1));
      test::ok(dfm_body_set_filter(b, 2, 2));
    } else {
      test::ok(dfm_world_filter_pair(w, "a", "b", false));
    }
    test::run(w, 1e-3, 1e-3);
    test::set_velocity(a, {-1, 0, 0});
    test::run(w, 0.1, 1e-3);  // 0.25 apart
    test::set_velocity(a, {1, 0, 0});
    test::run(w, 0.1, 1e-3);
    EXPECT_LT(test::measure(b).velocity[0], 1e-9) << by_masks;
    dfm_world_destroy(w);
  }
}

TEST(Overlap, FoundBeforeFurtherThingsCome_IsReportedByTheStep) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  ball(c, w, "a", {});
  ball(c, w, "b", {0.1, 0, 0});
  double step = 0;
  test::ok(dfm_world_stable_step(w, &step, nullptr, nullptr));  // searches
  ball(c, w, "elsewhere", {3, 0, 0});
  uint32_t trouble = 0;
  ASSERT_EQ(dfm_world_step(w, 1e-3, &trouble), DFM_OK) << dfm_last_error();
  EXPECT_TRUE(trouble & DFM_TROUBLE_OVERLAP);
  EXPECT_EQ(overlaps(w).size(), 1u);
  dfm_world_destroy(w);
}

TEST(Overlap, OfAPairThatTheHostMovesApart_HasContactAtOnce) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  const dfm_body a = ball(c, w, "a", {}), b = ball(c, w, "b", {0.1, 0, 0});
  test::run(w, 1e-3, 1e-3);
  std::vector<double> x = test::State(a).x;
  uint32_t n = uint32_t(x.size() / 3);
  for (size_t i = 0; i < x.size(); i += 3) x[i] -= 0.102;  // 2 mm from b
  test::ok(dfm_body_set_state(a, n, x.data(), nullptr));
  test::set_velocity(a, {2, 0, 0});
  test::run(w, 0.1, 1e-3);  // two steps later it would be inside
  EXPECT_GT(test::measure(b).velocity[0], 0.5);
  test::ok(dfm_world_find_overlaps(w, &n));
  EXPECT_EQ(n, 0u);
  dfm_world_destroy(w);
}

TEST(Overlap, OfACoarseBodyALittleInAFineOne_IsNotSetAside) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  test::BodyOptions o;
  o.name = "fine";
  test::make_body(c, w, "beam", {0.3, 0.3, 0.06}, 20000, o);
  o.name = "coarse";
  o.position = {0.05, 0.05, 0.0595};
  test::make_body(c, w, "beam", {0.2, 0.2, 0.2}, 12, o);
  const auto found = overlaps(w);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_GT(found[0].enclosed, 100u);
  EXPECT_FALSE(found[0].flags & DFM_OVERLAP_ASIDE);
  dfm_world_destroy(w);
}

TEST(Overlap, WithAFlatOpenMesh_IsFound) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  ball(c, w, "ball", {});
  const test::Triangles sheet{{-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0}, {0, 1, 2, 0, 2, 3}};
  thing(w, DFM_SHAPE_MESH, 0, &sheet);
  EXPECT_EQ(overlaps(w).size(), 1u);
  dfm_world_destroy(w);
}

TEST(Overlap, WithAPointThatNoTriangleHas_IsNone) {
  for (const uint32_t shape : {DFM_SHAPE_MESH, DFM_SHAPE_VOXELS}) {
    test::Context c;
    const dfm_world w = test::make_world(c, {});
    ball(c, w, "ball", {1, 0, 0});
    test::Triangles box = test::box_surface({0.1, 0.1, 0.1}, 1);
    box.points.insert(box.points.end(), {1, 0, 0});
    thing(w, shape, 0, &box);
    EXPECT_TRUE(overlaps(w).empty()) << shape;
    dfm_world_destroy(w);
  }
}

TEST(Overlap, UntangledBeforeTheStep_IsNoTrouble) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  ball(c, w, "a", {});
  ball(c, w, "b", {0.15, 0, 0});
  double step = 0;
  test::ok(dfm_world_stable_step(w, &step, nullptr, nullptr));  // searches
  uint32_t left = 1, trouble = 0;
  test::ok(dfm_world_untangle(w, &left));
  EXPECT_EQ(left, 0u);
  ASSERT_EQ(dfm_world_step(w, 1e-3, &trouble), DFM_OK) << dfm_last_error();
  EXPECT_FALSE(trouble & DFM_TROUBLE_OVERLAP);
  dfm_world_destroy(w);
}
