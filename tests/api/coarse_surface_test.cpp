// A body that is filled from a surface of a few large triangles.
#include <unistd.h>

#include "support.h"
#include "world.h"

// A hexagonal prism of 12 points. Contact at these alone crushes six cells, and the body sinks through the
// floor.
TEST(CoarseSurface, APrismOfTwentyTriangles_StandsOnTheFloor) {
  const std::string folder = test::scratch("coarse_surface_" + std::to_string(getpid()));
  std::string obj;
  for (const char *z : {"0", "1"})
    for (int i = 0; i < 6; ++i) {
      const double angle = i * std::acos(-1.0) / 3;
      obj += "v " + std::to_string(std::cos(angle)) + " " + std::to_string(std::sin(angle)) + " " + z + "\n";
    }
  obj += "f 6 5 4 3 2 1\nf 7 8 9 10 11 12\n";
  for (int i = 0; i < 6; ++i)
    for (const int k : {i + 1, (i + 1) % 6 + 1, (i + 1) % 6 + 7, i + 7})
      obj += (k == i + 1 ? "f " : " ") + std::to_string(k) + (k == i + 7 ? "\n" : "");
  test::write_file(folder + "/prism.obj", obj);
  test::write_file(folder + "/scene.json",
                   R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.5},
    "bodies": [{"name": "prism", "mesh": "prism.obj", "fill": {"cells": 1000},
      "pose": {"position": [0, 0, 0.05]}}],
    "obstacles": [{"name": "floor", "shape": "plane"}]})");
  const test::Context context;
  dfm_scene scene = 0;
  test::ok(dfm_scene_open(context, (folder + "/scene.json").c_str(), nullptr, &scene));
  dfm_world world = 0;
  dfm_body prism = 0;
  test::ok(dfm_scene_world(scene, &world));
  test::ok(dfm_world_find_body(world, "prism", &prism));
  const std::vector<double> x = test::listed(dfm_surface_positions, prism, 3);
  EXPECT_GE(x.size() / 3, 40u);
  EXPECT_NEAR(x[3 * 5], 0.5, 1e-5);  // the file's points keep their numbers
  for (int i = 0; i < 50; ++i) {
    test::run(world, 0.01, 2e-3);
    ASSERT_GT(test::measure(prism).com[2], 0.35) << i;
    ASSERT_EQ(test::measure(prism).inverted, 0u) << i;
  }
  test::ok(dfm_scene_close(scene));
}
