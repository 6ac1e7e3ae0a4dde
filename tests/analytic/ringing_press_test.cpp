// An elastic ball without damping that rings for ever between a floor and a press that has come to rest: what
// sticks stays where it is, although the solve may leave an error in every sub-step of a body that shakes
// (doc/decisions/contact_solver.md).
#include <deform/scene.h>

#include <fstream>

#include "support.h"
#include "world.h"

namespace {

struct Hold {
  double creep = NAN;  // m/s
  uint32_t n = 0;
};

// The press sinks for 0.2 s; the last half of the second is measured.
Hold hold(const std::string &model, double step, const std::string &law) {
  const std::string path = test::scratch("ringing_press") + "/scene.json";
  std::ofstream(path) << R"({"format": "deform-scene", "version": 1, "time": {"duration": 1},
    "materials": {"muscle": {"density": 1060, "young": 1e5, "poisson": 0.3}},
    "bodies": [{"name": "ball", "mesh": {"make": "ball", "radius": 0.05, "cells": 300}, "material": "muscle",
      "model": {"type": ")"
                      << model << R"("}, "pose": {"position": [0, 0, 0.0505]}}],
    "obstacles": [{"name": "floor", "shape": "plane"},
      {"name": "press", "shape": "sphere", "radius": 0.03, "pose": {"position": [0, 0, 0.1355]},
       "motion": {"keyframes": [{"t": 0, "position": [0, 0, 0.1355]},
                                {"t": 0.2, "position": [0, 0, 0.10035]}]}}],
    "contact": {"friction": [{"between": ["*", "*"], "law": ")"
                      << law << R"(", "params": {"mu": 1.0}}]}})";
  test::Context context;
  dfm_world world = 0;
  test::ok(dfm_scene_load(context, path.c_str(), &world));
  test::run(world, 0.5, step);
  test::ok(dfm_world_hold_begin(world));
  test::run(world, 0.5, step);
  Hold out;
  test::ok(dfm_world_hold(world, &out.creep, &out.n));
  return out;
}

}  // namespace

TEST(RingingPress, WhatSticks_StaysAtAnyStepAndModel) {
  for (const char *model : {"msm", "corotational_fem", "meshless"})
    for (const char *law : {"coulomb", "karnopp"})
      for (const double step : {0.001, 0.01}) {
        const Hold h = hold(model, step, law);
        EXPECT_GE(h.n, 3u) << model << " " << law << " " << step;
        EXPECT_LT(h.creep, 1e-8) << model << " " << law << " " << step;  // without it: 3e-7 and more
      }
}
