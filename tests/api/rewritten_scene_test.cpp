// A written scene that is loaded again: materials, limits, and the order of loads and attachments.
#include <unistd.h>

#include "support.h"
#include "world.h"

namespace {

std::string path_of(const std::string &name) {
  return test::scratch("rewritten_" + std::to_string(getpid())) + "/" + name + ".json";
}

void write(dfm_world world, const std::string &path) {
  test::ok(dfm_world_write_scene(world, path.c_str(), nullptr, nullptr));
}

dfm_world load(dfm_context *context, const std::string &path) {
  dfm_world out = 0;
  EXPECT_EQ(dfm_scene_load(context, path.c_str(), &out), DFM_OK) << dfm_last_error();
  return out;
}

void steps(dfm_world world, int n, double h) {
  for (int i = 0; i < n; ++i) test::ok(dfm_world_step(world, h, nullptr));
}

}  // namespace

TEST(RewrittenScene, OrderOfLoadsAndAttachments_GivesTheSameBits) {
  test::Context context;
  const dfm_world world = test::make_world(context);
  const dfm_obstacle ground = test::add_plane(world, "floor");
  test::BodyOptions o;
  o.name = "block";
  o.position = {0, 0, 0.02};
  const dfm_body block = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 200, o);
  o.name = "ball";
  o.position = {0.05, 0.05, 0.3};
  const dfm_body ball = test::make_body(context, world, "ball", {0.05, 0, 0}, 200, o);
  const uint32_t pushed[] = {2, 7, 9};
  const double force[] = {0.3, 0, 0.7, 0, 0.3, 0, 0.11, 0.17, 0};
  test::ok(dfm_body_add_load(ball, 3, pushed, force, 0, nullptr, nullptr, nullptr));
  const dfm_scale_key scale[] = {{0, 0}, {1, 2}};
  test::ok(dfm_body_add_load(ball, 3, pushed, force, 2, scale, nullptr, nullptr));
  test::ok(dfm_body_add_load(ball, 3, pushed, force, 0, nullptr, nullptr, nullptr));
  const uint32_t points[] = {11, 12, 13, 14};
  dfm_attach_def attach = dfm_attach_def_default();
  attach.npoint = 4;
  attach.points = points;
  attach.to = ground;
  test::ok(dfm_body_attach(ball, &attach, nullptr));
  attach.to = ball;
  test::ok(dfm_body_attach(block, &attach, nullptr));
  const std::string path = path_of("order");
  write(world, path);
  const dfm_world again = load(context, path);
  ASSERT_TRUE(again);
  for (const dfm_world w : {world, again}) steps(w, 60, 1e-4);
  EXPECT_EQ(dfm_world_hash(again), dfm_world_hash(world));
}

TEST(RewrittenScene, BodyMaterialThatNoCellHas_KeepsItsName) {
  test::Context context;
  const dfm_world world = test::make_world(context);
  const double friction = 0.9;
  const dfm_param_value row = {"friction", &friction, 1};
  dfm_material_def m = dfm_material_def_default();
  dfm_material gel = 0;
  test::Tet tet("b");
  m.name = "gel";
  test::ok(dfm_material_create(world, &m, &gel));
  m.name = "skin";
  m.extra = {sizeof m.extra, 1, &row};
  test::ok(dfm_material_create(world, &m, &tet.def.material));
  tet.def.cell_materials = &gel;
  dfm_body body = 0;
  test::ok(dfm_body_create(world, &tet.def, &body));
  const std::string path = path_of("skin");
  write(world, path);
  EXPECT_NE(test::read_file(path).find(R"("material": "skin")"), std::string::npos);
  EXPECT_TRUE(load(context, path));
}

TEST(RewrittenScene, WhatTheLibraryTakes_AlsoASceneTakes) {
  test::Context context;
  dfm_world_def def = dfm_world_def_default();
  def.max_sweeps = def.solver_iterations = def.newton_iterations = UINT32_MAX;
  dfm_world world = 0;
  test::ok(dfm_world_create(context, &def, &world));
  dfm_body body = 0;
  const test::Tet tet("b");
  test::ok(dfm_body_create(world, &tet.def, &body));
  const dfm_sine back = {{1e-3, 0, 0}, -2, 0};
  const uint32_t point = 0;
  const double force[] = {0, 0, 1e-3};
  test::ok(dfm_body_add_load(body, 1, &point, force, 0, nullptr, &back, nullptr));
  dfm_separate_def parts = dfm_separate_def_default();
  parts.least_cells = UINT32_MAX;
  test::ok(dfm_body_set_separate(body, &parts));
  const std::string path = path_of("limits");
  write(world, path);
  const dfm_world again = load(context, path);
  ASSERT_TRUE(again);
  for (const dfm_world w : {world, again}) steps(w, 20, 1e-3);
  EXPECT_EQ(dfm_world_hash(again), dfm_world_hash(world));
}
