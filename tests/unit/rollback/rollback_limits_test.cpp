// What the scheme refuses, and that it does not depend on threads.
#include "bristle_law.h"
#include "coupled.h"
#include "rigid.h"
#include "rollback_cases.h"

namespace {

namespace rb = test::rollback;

// A block on a floor, and what `add` adds.
void expect_refused(const std::string &what, const std::function<void(rb::World &, dfm_body)> &add) {
  rb::World w(rb::By::rollback, {0, 0, -rb::kG}, 0.5);
  test::add_plane(w.world, "floor");
  add(w, w.block("block", {0, 0, 1e-3}));
  EXPECT_EQ(w.scheme.step(w.world, 1e-3, nullptr), DFM_E_UNSUPPORTED) << what;
  test::says({what.c_str(), "deform run"});
  EXPECT_EQ(dfm_world_time(w.world), 0);
}

const dfm_pose_key kLift[] = {{0, {{0, 0, 0}, {0, 0, 0, 1}}}, {1, {{0, 0, 1}, {0, 0, 0, 1}}}};

void add_obstacle(rb::World &w, dfm_obstacle_def d) {
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w.world, &d, &o));
}

}  // namespace

TEST(RollbackLimits, WhatItCannotDo_IsRefusedBeforeTheFirstStep) {
  expect_refused("obstacle 'grid': voxels", [](rb::World &w, dfm_body) {
    const double points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const uint32_t triangles[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.name = "grid";
    d.shape = DFM_SHAPE_VOXELS;
    d.npoint = 4;
    d.ntriangle = 4;
    d.points = points;
    d.triangles = triangles;
    add_obstacle(w, d);
  });
  expect_refused("obstacle 'lift': a motion", [](rb::World &w, dfm_body) {
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.name = "lift";
    d.shape = DFM_SHAPE_SPHERE;
    d.keys = kLift;
    d.nkey = 2;
    add_obstacle(w, d);
  });
  expect_refused("body 'block': a motion of held points", [](rb::World &, dfm_body b) {
    const uint32_t point = 0;
    test::ok(dfm_body_hold(b, 1, &point, 7));
    test::ok(dfm_body_move_held(b, 1, &point, 2, kLift, nullptr));
  });
  expect_refused("sleep", [](rb::World &w, dfm_body) { test::ok(dfm_world_set_sleep(w.world, true)); });
  expect_refused("rigid bodies", [](rb::World &w, dfm_body) {
    const dfm_rigid_def box = test::box("crate", {0.1, 0.1, 0.1}, 1);
    const dfm_rigid_set_def set = {sizeof set, 1, 0, 0, &box, nullptr, nullptr};
    dfm_rigid rigid = 0;
    test::ok(dfm_rigid_create(w.world, nullptr, &set, &rigid));
  });
  expect_refused("body 'worn': a surface of its own", [](rb::World &w, dfm_body) {
    const test::Skin skin = test::box_skin({0.1, 0.1, 0.1}, 2);
    const dfm_surface_def surface = skin.def();
    test::BodyOptions o;
    o.name = "worn";
    o.surface = &surface;
    o.position = {0, 0, 1};
    test::make_body(w.context, w.world, "beam", {0.1, 0.1, 0.1}, 20, o);
  });
  expect_refused("a friction law with memory", [](rb::World &w, dfm_body) {
    test::ok(dfm_plugin_register_static(w.context, dfm_plugin_entry_bristle, "bristle"));
    const double mu = 0.5;
    const dfm_param_value value{"mu", &mu, 1};
    const dfm_friction_def memory = {
        sizeof memory, 0, {"*", "*"}, "test.bristle", {sizeof(dfm_params), 1, &value}, 0};
    test::ok(dfm_world_add_friction(w.world, &memory));
  });
}

TEST(RollbackLimits, OneToEightThreads_GiveTheSameHash) {
  uint64_t first = 0;
  for (const uint32_t threads : {1u, 2u, 3u, 8u}) {
    rb::World w(rb::By::rollback, {0, 0, -rb::kG}, 0.4, threads);
    test::add_plane(w.world, "floor");
    w.block("first", {0, 0, 4e-5}, {0.3, 0, -0.2}, 60);
    w.block("second", {0.01, -0.12, 0.003}, {0, 0.8, 0}, 60);
    w.run(0.04, 1e-3);
    EXPECT_GT(test::stats(w.world).contacts, 0u);
    const uint64_t hash = dfm_world_hash(w.world);
    if (!first) first = hash;
    EXPECT_EQ(hash, first) << threads << " threads";
  }
}
