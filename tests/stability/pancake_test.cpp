// A body under a load that is beyond its material, with `collapse`: it becomes a pancake whose cells keep
// their orientation, and comes back when the load is gone.
#include <unistd.h>

#include "opened.h"

namespace {

struct Fallen {
  uint32_t inverted = 0;      // cells, the most at once
  double flat = 0, back = 0;  // volume under the load and at the end
};

// A cube of 20 cm and 1 kPa, whose weight is twice its modulus.
test::Opened cube_above(double height, double damping, const char *integrator, double collapse) {
  const std::string folder = test::scratch("pancake_" + std::to_string(getpid()));
  return test::Opened(test::written(folder + "/scene.json",
                                    R"({"format": "deform-scene", "version": 1, "time": {"duration": 3},
    "materials": {"jelly": {"density": 1000, "young": 1000, "damping": {"stiffness": )" +
                                        std::to_string(damping) + R"(}, "friction": 0.5}},
    "bodies": [{"name": "cube", "mesh": {"make": "beam", "size": [0.2, 0.2, 0.2], "cells": 1000},
      "material": "jelly", "integrator": ")" +
                                        integrator + R"(", "pose": {"position": [0, 0, )" +
                                        std::to_string(height) + R"(]},
      "model": {"type": "corotational_fem", "params": {"collapse": )" +
                                        std::to_string(collapse) + R"(}}}],
    "obstacles": [{"name": "floor", "shape": "plane"}]})"));
}

// It falls from 0.5 m, by five times its modulus, and lies for a second; then there is no gravity for another
// one and a half.
Fallen fall(double collapse) {
  test::Opened scene = cube_above(0.5, 0.005, "implicit_euler", collapse);
  test::ok(scene.status);
  dfm_body cube = 0;
  test::ok(dfm_world_find_body(scene.world, "cube", &cube));
  dfm_body_measure m{};
  m.size = sizeof m;
  Fallen out;
  for (int n = 0; n < 180; ++n) {
    const double none[3] = {};
    if (n == 90) test::ok(dfm_world_set_gravity(scene.world, none));
    test::ok(dfm_world_step(scene.world, 1.0 / 60, nullptr));
    test::ok(dfm_body_get_measure(cube, &m));
    out.inverted = std::max(out.inverted, m.inverted);
    if (n == 89) out.flat = m.volume / m.rest_volume;
  }
  out.back = m.volume / m.rest_volume;
  return out;
}

}  // namespace

// soak: long; the test below has the same cube, put down
TEST(Pancake, JellyThatFalls_KeepsItsCellsUprightAndComesBack) {
  const Fallen with = fall(30);
  EXPECT_EQ(with.inverted, 0u);
  EXPECT_GT(with.flat, 0.5);
  EXPECT_NEAR(with.back, 1, 0.01);
  const Fallen without = fall(0);
  EXPECT_GT(without.inverted, 300u) << "of 960 cells";
  EXPECT_LT(without.flat, 0.1);
}

// The rates of strain are zero at the first check of the step bound. The next one must be early: the cube
// falls in behind its contacts, and its cells stiffen (doc/decisions/explicit_time.md).
TEST(Pancake, JellyPutDown_ExplicitStepsFollowItsStiffness) {
  for (const double collapse : {15.0, 30.0, 60.0}) {
    test::Opened scene = cube_above(0.0012, 0, "symplectic_euler", collapse);
    test::ok(scene.status);
    dfm_body cube = 0;
    test::ok(dfm_world_find_body(scene.world, "cube", &cube));
    for (int n = 0; n < 30; ++n) {
      ASSERT_EQ(dfm_world_step(scene.world, 1.0 / 60, nullptr), DFM_OK) << dfm_last_error();
      const dfm_body_measure m = test::measure(cube);
      // J, its weight of 78 N on a way of half its height: all that there is to gain
      ASSERT_LT(m.kinetic, 7.8) << collapse << ", step " << n;
      EXPECT_LT(m.inverted, 0.04 * 960) << collapse << ", step " << n;
    }
  }
}
