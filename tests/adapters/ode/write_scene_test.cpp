// dfm_world_write_scene of worlds whose rigid bodies ODE moves: written and loaded again they are the same.
#include <gtest/gtest.h>

#include "deform/ode_host.h"
#include "support.h"
#include "world.h"

namespace {

class OdeScene : public testing::TestWithParam<const char *> {};

dfm_world load(dfm_context *context, const std::string &path) {
  dfm_world out = 0;
  EXPECT_EQ(dfm_scene_load(context, path.c_str(), &out), DFM_OK) << dfm_last_error();
  return out;
}

}  // namespace

TEST_P(OdeScene, WrittenAndLoaded_IsTheSameWorld) {
  ASSERT_EQ(dfm_ode_register(), DFM_OK);
  test::Context context;
  const std::string name = GetParam(), path = test::scratch("write_" + name) + "/scene.json";
  const dfm_world world = load(context, DEFORM_SOURCE_DIR "/examples/scenes/" + name + ".json");
  ASSERT_TRUE(world);
  test::ok(dfm_world_write_scene(world, path.c_str(), nullptr, nullptr));
  const dfm_world again = load(context, path);
  ASSERT_TRUE(again);
  EXPECT_EQ(dfm_world_hash(again), dfm_world_hash(world));
  for (int i = 0; i < 10; ++i)
    for (const dfm_world w : {world, again}) test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_EQ(dfm_world_hash(again), dfm_world_hash(world));
}

INSTANTIATE_TEST_SUITE_P(Each, OdeScene,
                         testing::Values("ode_bed", "ode_cart", "ode_chain", "ode_gripper", "ode_seesaw"),
                         [](const auto &scene) { return std::string(scene.param); });
