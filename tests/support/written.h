// A world of a scene that has run for 0.02 s, and that world written as a scene and loaded again.
#pragma once
#include <gtest/gtest.h>

#include <string>

#include "support.h"
#include "world.h"

namespace test {

struct Written {
  dfm_world world = 0, again = 0;
  // Writes scene.json to the folder, which may hold what the scene names.
  Written(dfm_context *context, const std::string &folder, const char *scene) {
    const std::string path = folder + "/scene.json", copy = folder + "/copy.json";
    write_file(path, scene);
    ok(dfm_scene_load(context, path.c_str(), &world));
    run(world, 0.02, 0.01);
    ok(dfm_world_write_scene(world, copy.c_str(), nullptr, nullptr));
    ok(dfm_scene_load(context, copy.c_str(), &again));
  }
  // The body of that name, strained, is the same in both; returns it.
  dfm_body same(const char *name) const {
    dfm_body a = 0, b = 0;
    ok(dfm_world_find_body(world, name, &a));
    ok(dfm_world_find_body(again, name, &b));
    const dfm_body_measure m = measure(a), n = measure(b);
    EXPECT_GT(m.elastic, 0);
    EXPECT_NEAR(n.elastic / m.elastic, 1, 1e-9) << name;
    EXPECT_NEAR(n.mass, m.mass, 1e-14) << name;
    return a;
  }
};

}  // namespace test
