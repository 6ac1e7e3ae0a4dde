// Boxes whose sides are nearly flush: edges that pass each other beyond their ends are through nothing, and
// no contact may say so. A crossing past an end still counts while it is within the rest distance, or edges
// that slide over each other's ends would lose each other.
#include "support.h"
#include "world.h"

TEST(EdgeDepth, StackedBoxesWithFlushSides_NoContactIsDeeperThanTheRestDistance) {
  const std::string path = test::scratch("edge_depth") + "/two_boxes.json";
  test::write_file(path, R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.6, "step": 0.001},
    "materials": {"gel": {"density": 1000, "young": 2e5, "poisson": 0.3,
                          "damping": {"mass": 15, "stiffness": 0.002}}},
    "bodies": [
      {"name": "lower", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.05], "cells": 24}, "material": "gel",
       "pose": {"position": [0, 0, 0.002]}},
      {"name": "upper", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.05], "cells": 24}, "material": "gel",
       "pose": {"position": [0, 0, 0.0545]}}],
    "obstacles": [{"name": "floor", "shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}],
    "contact": {"offset": 5e-5,
                "friction": [{"between": ["*", "*"], "law": "coulomb", "params": {"mu": 0.5}}]}})");
  test::Context context;
  for (const uint64_t seed : {5, 9, 10}) {
    dfm_scene_options options{sizeof options, 0, nullptr, seed};
    dfm_scene scene = 0;
    dfm_world world = 0;
    DFM_OK_OR_DIE(dfm_scene_open(context, path.c_str(), &options, &scene));
    DFM_OK_OR_DIE(dfm_scene_world(scene, &world));
    double deepest = 0;
    for (int step = 0; step < 400; ++step) {
      test::run(world, 1e-3, 1e-3);
      for (const dfm_contact &c : test::contacts(world)) deepest = std::min(deepest, c.gap);
    }
    // gap: distance less the rest distance, 5e-5 m; up to 4e-4 where any crossing past an end counted
    EXPECT_GT(deepest, -1e-4) << "seed " << seed;
    DFM_OK_OR_DIE(dfm_scene_close(scene));
  }
}
