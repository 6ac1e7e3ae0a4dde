// Numbers that a step can mean nothing by are refused where they come in, with the reason; obstacles move no
// faster than they may.
#include <limits>

#include "world.h"

namespace {

void refused(dfm_status status, std::initializer_list<const char *> parts) {
  EXPECT_EQ(status, DFM_E_ARG);
  test::says(parts);
}

dfm_pose at(double z) { return {{0, 0, z}, {0, 0, 0, 1}}; }

dfm_obstacle box(dfm_world w, double z) {
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = "jaw";
  d.shape = DFM_SHAPE_BOX;
  d.pose = at(z);
  for (double &h : d.half_size) h = 0.1;
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w, &d, &o));
  return o;
}

}  // namespace

TEST(Bounds, PlacesThatNumbersDoNotResolve_AreRefused) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  test::Tet t("tet");
  dfm_body b = 0;
  t.def.pose.position[0] = 1e15;
  refused(dfm_body_create(w, &t.def, &b), {"'tet'", "1e+15", "origin"});
  t.def.pose.position[0] = 1e6;
  ASSERT_EQ(dfm_body_create(w, &t.def, &b), DFM_OK) << dfm_last_error();
  test::ok(dfm_world_step(w, 1e-4, nullptr));
  double x[12];
  for (int i = 0; i < 12; ++i) x[i] = t.points[i] + 1e15;
  const uint64_t before = dfm_world_hash(w);
  refused(dfm_body_set_state(b, 4, x, nullptr), {"'tet'", "origin"});
  EXPECT_EQ(dfm_world_hash(w), before);
  const dfm_obstacle o = box(w, 5);
  const dfm_pose far = at(1e15);
  refused(dfm_obstacle_move_to(o, &far), {"'jaw'", "origin"});
  refused(dfm_obstacle_teleport(o, &far), {"'jaw'", "origin"});
  dfm_world_destroy(w);
}

TEST(Bounds, FarObstacle_IsRefusedByTheFirstStep) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  box(w, 1e15);
  test::Tet t("tet");
  dfm_body b = 0;
  test::ok(dfm_body_create(w, &t.def, &b));
  refused(dfm_world_step(w, 1e-4, nullptr), {"obstacle 'jaw'", "origin"});
  dfm_world_destroy(w);
}

TEST(Bounds, SpeedsAboveThatOfLight_AreRefused) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  test::Tet t("tet");
  dfm_body b = 0;
  t.def.velocity[1] = 1e200;
  refused(dfm_body_create(w, &t.def, &b), {"'tet'", "1e+200", "light"});
  t.def.velocity[1] = 0;
  t.def.spin[2] = 1e200;
  refused(dfm_body_create(w, &t.def, &b), {"'tet'", "light"});
  t.def.spin[2] = 0;
  test::ok(dfm_body_create(w, &t.def, &b));
  double v[12] = {};
  v[5] = -1e200;
  const uint64_t before = dfm_world_hash(w);
  refused(dfm_body_set_state(b, 4, nullptr, v), {"'tet'", "light"});
  EXPECT_EQ(dfm_world_hash(w), before);

  dfm_rigid_def r = dfm_rigid_def_default();
  r.name = "stone";
  r.shape = DFM_SHAPE_SPHERE;
  r.radius = 0.1;
  r.mass = 1;
  r.velocity[0] = 1e200;
  r.pose.position[2] = 5;
  dfm_rigid_set_def set{};
  set.size = sizeof set;
  set.nbody = 1;
  set.bodies = &r;
  dfm_rigid rigid = 0;
  refused(dfm_rigid_create(w, nullptr, &set, &rigid), {"'stone'", "light"});
  dfm_world_destroy(w);
}

TEST(Bounds, OffsetLargerThanATenthOfTheThinnestBody_IsRefused) {
  for (const double offset : {1.0, 0.01, 1e-4}) {
    test::Context c;
    dfm_world_def d = dfm_world_def_default();
    d.contact_offset = offset;
    dfm_world w = 0;
    test::ok(dfm_world_create(c, &d, &w));
    test::BodyOptions o;
    o.name = "block";
    o.position = {0, 0, 2e-4};
    o.damping_stiffness = 1e-3;
    const dfm_body b = test::make_body(c, w, "beam", {0.1, 0.1, 0.05}, 100, o);
    test::add_plane(w, "floor");
    if (offset > 1e-3) {
      refused(dfm_world_step(w, 1e-3, nullptr), {"'block'", "offset", "tenth"});
    } else {
      test::run(w, 0.05, 1e-3);
      EXPECT_LT(test::measure(b).speed_max, 0.5);
    }
    dfm_world_destroy(w);
  }
}

TEST(Bounds, ObstacleMotionThatIsTooFast_IsRefusedAndTeleportThrowsNothing) {
  test::Context c;
  const dfm_world w = test::make_world(c, {});
  test::BodyOptions o;
  o.damping_stiffness = 1e-3;
  o.position = {0, 0, 0.5};
  const dfm_body b = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 100, o);
  const dfm_obstacle jaw = box(w, -0.5);
  test::run(w, 0.01, 1e-3);
  const dfm_pose above = at(1.5), near = at(-0.4);
  test::ok(dfm_obstacle_move_to(jaw, &above));
  const uint64_t before = dfm_world_hash(w);
  refused(dfm_world_step(w, 1e-3, nullptr), {"'jaw'", "2000 m/s", "dfm_obstacle_teleport"});
  EXPECT_EQ(dfm_world_hash(w), before);
  test::ok(dfm_obstacle_move_to(jaw, &near));  // 100 m/s
  test::ok(dfm_world_step(w, 1e-3, nullptr));
  test::ok(dfm_obstacle_teleport(jaw, &above));
  dfm_pose now{};
  test::ok(dfm_obstacle_get_pose(jaw, &now));
  EXPECT_EQ(now.position[2], 1.5);
  test::run(w, 0.05, 1e-3);
  EXPECT_LT(test::measure(b).speed_max, 1e-9);
  const dfm_pose into = at(0.5);
  test::ok(dfm_obstacle_teleport(jaw, &into));
  uint32_t trouble = 0;
  test::ok(dfm_world_step(w, 1e-3, &trouble));
  EXPECT_TRUE(trouble & DFM_TROUBLE_OVERLAP);
  EXPECT_LT(test::measure(b).speed_max, 1);
  dfm_world_destroy(w);
}

TEST(Bounds, ObstacleKeysTooFast_AreRefusedWhenItIsMade) {
  test::Context c;
  dfm_world_def wd = dfm_world_def_default();
  for (const double limit : {0.0, 5000.0}) {
    wd.obstacle_speed = limit;
    dfm_world w = 0;
    test::ok(dfm_world_create(c, &wd, &w));
    const dfm_pose_key keys[] = {{0, at(0)}, {1e-3, at(2)}};
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.name = "jaw";
    d.nkey = 2;
    d.keys = keys;
    dfm_obstacle o = 0;
    if (limit == 0) refused(dfm_obstacle_create(w, &d, &o), {"'jaw'", "2000 m/s", "obstacle_speed"});
    else test::ok(dfm_obstacle_create(w, &d, &o));
    dfm_world_destroy(w);
  }
}

TEST(Bounds, RecoverySpeed_OpensADepthThatFastAndNoFaster) {
  for (const double speed : {0.0, 0.02, 0.1}) {
    test::Context c;
    dfm_world_def d = dfm_world_def_default();
    d.gravity[2] = 0;
    d.recovery_speed = speed;
    dfm_world w = 0;
    test::ok(dfm_world_create(c, &d, &w));
    test::BodyOptions o;
    o.position = {0, 0, -0.01};
    o.damping_stiffness = 1e-3;
    const dfm_body b = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 200, o);
    test::add_plane(w, "floor");
    const double start = test::measure(b).com[2];
    test::run(w, 0.1, 1e-3);
    const double mean = (test::measure(b).com[2] - start) / 0.1;
    // the body swings about the surface that is pushed
    if (speed > 0) EXPECT_NEAR(mean, 1.25 * speed, 0.5 * speed);
    else EXPECT_LT(mean, 0.018);
    test::run(w, 0.6, 1e-3);
    EXPECT_LT(test::measure(b).velocity[2], speed > 0 ? 2 * speed : 0.018);
    dfm_world_destroy(w);
  }
}
