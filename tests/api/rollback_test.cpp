// contact.method rollback: what it refuses, what the plan says, what a snapshot of it holds.
#include "bristle_law.h"
#include "coupled.h"
#include "rigid.h"
#include "rollback_cases.h"
#include "support.h"

namespace {

namespace rb = test::rollback;

void refused(dfm_status status, const std::string &what) {
  EXPECT_EQ(status, DFM_E_UNSUPPORTED) << what;
  const std::string text = dfm_last_error();
  EXPECT_NE(text.find(what), std::string::npos) << text;
  EXPECT_NE(text.find("rollback"), std::string::npos) << text;
  EXPECT_NE(text.find("use the method velocity"), std::string::npos) << text;
}

std::vector<unsigned char> snapshot(dfm_world w) {
  size_t bytes = 0;
  test::ok(dfm_world_snapshot(w, nullptr, &bytes));
  std::vector<unsigned char> out(bytes);
  test::ok(dfm_world_snapshot(w, out.data(), &bytes));
  return out;
}

struct Thrown : rb::World {
  explicit Thrown(int32_t method = DFM_METHOD_ROLLBACK, uint32_t threads = 1)
      : World(method, {0, 0, -rb::kG}, 0.4, threads) {
    test::add_plane(world, "floor");
    block("first", {0, 0, 4e-5}, {0.3, 0, -0.2}, 60);
    block("second", {0.01, -0.12, 0.003}, {0, 0.8, 0}, 60);
  }
};

}  // namespace

TEST(RollbackWorld, WhatItCannotDo_IsRefusedWhereItIsMade) {
  rb::World w(DFM_METHOD_ROLLBACK, {0, 0, -rb::kG}, 0.5);
  const dfm_obstacle floor = test::add_plane(w.world, "floor");
  const dfm_body b = w.block("block", {0, 0, 1e-3});

  dfm_obstacle_def voxels = dfm_obstacle_def_default();
  const double points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const uint32_t triangles[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
  voxels.name = "grid";
  voxels.shape = DFM_SHAPE_VOXELS;
  voxels.npoint = 4;
  voxels.ntriangle = 4;
  voxels.points = points;
  voxels.triangles = triangles;
  dfm_obstacle o = 0;
  refused(dfm_obstacle_create(w.world, &voxels, &o), "obstacle 'grid': voxels");
  dfm_obstacle_def moving = dfm_obstacle_def_default();
  const dfm_pose_key keys[] = {{0, {{0, 0, 0}, {0, 0, 0, 1}}}, {1, {{0, 0, 1}, {0, 0, 0, 1}}}};
  moving.name = "lift";
  moving.shape = DFM_SHAPE_SPHERE;
  moving.keys = keys;
  moving.nkey = 2;
  refused(dfm_obstacle_create(w.world, &moving, &o), "obstacle 'lift': a motion of its own");
  refused(dfm_obstacle_move_to(floor, &keys[1].pose), "obstacle 'floor': a motion of its own");

  const uint32_t point = 0;
  test::ok(dfm_body_hold(b, 1, &point, 7));
  refused(dfm_body_move_held(b, 1, &point, 2, keys, nullptr), "body 'block': a motion of held points");
  refused(dfm_world_set_sleep(w.world, true), "sleep (contact.sleep)");
  const dfm_rigid_def box = test::box("crate", {0.1, 0.1, 0.1}, 1);
  const dfm_rigid_set_def set = {sizeof set, 1, 0, 0, &box, nullptr, nullptr};
  dfm_rigid rigid = 0;
  refused(dfm_rigid_create(w.world, nullptr, &set, &rigid), "rigid bodies");

  const test::Skin skin = test::box_skin({0.1, 0.1, 0.1}, 2);
  const dfm_surface_def surface = skin.def();
  test::BodyOptions options;
  dfm_tetmesh mesh = 0;
  const double size[] = {0.1, 0.1, 0.1};
  test::ok(dfm_tetmesh_make(w.context, "beam", size, 20, &mesh));
  dfm_tetmesh_info info{};
  info.size = sizeof info;
  test::ok(dfm_tetmesh_get_info(mesh, &info));
  dfm_body_def d = dfm_body_def_default();
  const double *at = nullptr;
  const uint32_t *tets = nullptr;
  test::ok(dfm_tetmesh_data(mesh, &at, &tets, nullptr));
  d.name = "worn";
  d.npoint = info.npoint;
  d.ntet = info.ntet;
  d.points = at;
  d.tets = tets;
  d.surface = &surface;
  dfm_body worn = 0;
  refused(dfm_body_create(w.world, &d, &worn), "body 'worn': a surface of its own");
  test::ok(dfm_tetmesh_destroy(mesh));

  test::ok(dfm_plugin_register_static(w.context, dfm_plugin_entry_bristle, "bristle"));
  const double mu = 0.5;
  const dfm_param_value value{"mu", &mu, 1};
  const dfm_friction_def memory = {
      sizeof memory, 0, {"*", "*"}, "test.bristle", {sizeof(dfm_params), 1, &value}, 0};
  refused(dfm_world_add_friction(w.world, &memory), "friction law 'test.bristle': a memory");

  dfm_world_def sleepy = dfm_world_def_default();
  sleepy.method = DFM_METHOD_ROLLBACK;
  sleepy.sleep = 1;
  dfm_world other = 0;
  refused(dfm_world_create(w.context, &sleepy, &other), "sleep (contact.sleep)");
  // what is refused leaves nothing behind: the world steps on
  uint32_t n = 0;
  test::ok(dfm_world_bodies(w.world, 0, nullptr, &n));
  EXPECT_EQ(n, 1u);
  test::ok(dfm_world_obstacles(w.world, 0, nullptr, &n));
  EXPECT_EQ(n, 1u);
  test::run(w.world, 0.02, 1e-3);
}

TEST(RollbackWorld, UnknownMethod_IsRefused) {
  test::Context c;
  dfm_world_def d = dfm_world_def_default();
  dfm_world w = 0;
  for (const int32_t method : {4, -1}) {
    d.method = method;
    EXPECT_EQ(dfm_world_create(c, &d, &w), DFM_E_UNSUPPORTED);
  }
}

TEST(RollbackWorld, Plan_HasItsStagesOnlyOnRequest) {
  const Thrown rolls, solves(DFM_METHOD_VELOCITY);
  const std::string with = test::explain(rolls.world), without = test::explain(solves.world);
  EXPECT_NE(with.find("{\"name\":\"rollback\",\"why\":\"contact.method rollback"), std::string::npos) << with;
  EXPECT_NE(with.find("{\"name\":\"contact+friction\",\"why\":\"contact.method is rollback\"}"),
            std::string::npos)
      << with;
  EXPECT_NE(with.find("\"lagged friction\""), std::string::npos) << with;
  EXPECT_EQ(without.find("rollback"), std::string::npos) << without;
  EXPECT_EQ(without.find("lagged"), std::string::npos) << without;
}

// In mid-contact, with friction of the last sub-step on its way into the next one.
TEST(RollbackWorld, Snapshot_ContinuesWithTheSameBits) {
  Thrown a, b;
  test::run(a.world, 0.03, 1e-3);
  ASSERT_GT(test::stats(a.world).contacts, 3u);
  double friction = 0;
  for (const dfm_contact &c : test::contacts(a.world)) friction += std::fabs(c.ft[0]) + std::fabs(c.ft[1]);
  ASSERT_GT(friction, 0);
  const auto kept = snapshot(a.world);
  test::run(a.world, 0.03, 1e-3);
  test::ok(dfm_world_restore(b.world, kept.data(), kept.size()));
  test::run(b.world, 0.03, 1e-3);
  EXPECT_EQ(dfm_world_hash(a.world), dfm_world_hash(b.world));
  Thrown other(DFM_METHOD_VELOCITY);
  EXPECT_EQ(dfm_world_restore(other.world, kept.data(), kept.size()), DFM_E_FORMAT)
      << "a world of another method";
}

TEST(RollbackWorld, OneToEightThreads_GiveTheSameHash) {
  uint64_t first = 0;
  for (const uint32_t threads : {1u, 2u, 3u, 8u}) {
    Thrown w(DFM_METHOD_ROLLBACK, threads);
    test::run(w.world, 0.04, 1e-3);
    const uint64_t hash = dfm_world_hash(w.world);
    if (!first) first = hash;
    EXPECT_EQ(hash, first) << threads << " threads";
  }
}
