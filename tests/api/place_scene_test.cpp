// "place": a body put on an obstacle lies on top of it, whatever its pose was.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "support.h"
#include "world.h"

namespace {

struct Placed {
  test::Context context;
  dfm_scene scene = 0;
  dfm_status status = DFM_OK;
  std::vector<double> points;  // of the body's surface

  // The body is a cube of 0.2 m whose corner is at its origin.
  Placed(const std::string &obstacle, const std::string &pose, const std::string &more = "",
         const std::string &time = R"("duration": 0.1, "step": 0.001)") {
    const std::string path = test::scratch("place") + "/scene.json";
    test::write_file(path, R"({"format": "deform-scene", "version": 1,
      "time": {)" + time + R"(},
      "bodies": [{"name": "cube", "mesh": {"make": "beam", "size": [0.2, 0.2, 0.2], "cells": 60},
                  "place": {"on": "table"}, "pose": )" +
                               pose + R"(}],
      "obstacles": [{"name": "table", )" +
                               obstacle + "}]" + more + "}");
    status = dfm_scene_open(context, path.c_str(), nullptr, &scene);
    if (status != DFM_OK) return;
    dfm_world world = 0;
    dfm_body body = 0;
    uint32_t n = 0;
    test::ok(dfm_scene_world(scene, &world));
    test::ok(dfm_world_find_body(world, "cube", &body));
    test::ok(dfm_surface_positions(body, 0, nullptr, &n));
    points.resize(3 * size_t{n});
    test::ok(dfm_surface_positions(body, n, points.data(), &n));
  }
  ~Placed() {
    if (scene) dfm_scene_close(scene);
  }
  template <class Distance>
  double least(Distance distance) const {
    double out = HUGE_VAL;
    for (size_t i = 0; i + 2 < points.size(); i += 3) out = std::min(out, distance(&points[i]));
    return out;
  }
  double lowest() const {
    return least([](const double *p) { return p[2]; });
  }
};

const double kGap = 1e-4 * 0.2 * std::sqrt(3.0), kClose = 1e-7;
const char *const kBox = R"("shape": "box", "half_size": [1, 1, 0.4], "pose": {"position": [0, 0, 0.5]})";

}  // namespace

TEST(Place, OnABox_LiesOnItsTopWhereverItWas) {
  for (const char *height : {"5", "0.5", "-3"}) {
    const Placed p(kBox, std::string(R"({"position": [0.1, 0.2, )") + height + "]}");
    ASSERT_EQ(p.status, DFM_OK) << dfm_last_error();
    EXPECT_NEAR(p.lowest(), 0.9 + kGap, kClose) << height;
    EXPECT_NEAR(p.least([](const double *q) { return q[0]; }), 0.1, 1e-12) << "it moves up and down only";
  }
}

TEST(Place, OnWhatMoves_LiesOnItAtTheStart) {
  const Placed p(R"("shape": "box", "half_size": [1, 1, 0.1],
    "motion": {"keyframes": [{"t": 0, "position": [0, 0, 0]}, {"t": 1, "position": [0, 0, 1]}]})",
                 R"({"position": [0, 0, 3]})", "", R"("start": 1, "duration": 0.1, "step": 0.001)");
  ASSERT_EQ(p.status, DFM_OK) << dfm_last_error();
  EXPECT_NEAR(p.lowest(), 1.1 + kGap, kClose);
}

TEST(Place, ARotatedBody_LiesOnItsLowestCorner) {
  const Placed p(kBox, R"({"rotation": {"axis": [1, 2, 0.3], "angle_deg": 40}})");
  ASSERT_EQ(p.status, DFM_OK) << dfm_last_error();
  EXPECT_NEAR(p.lowest(), 0.9 + kGap, kClose);
}

TEST(Place, OnASlope_TouchesIt) {
  const Placed p(R"("shape": "plane", "normal": [0.6, 0, 0.8])", R"({"position": [0, 0, -1]})");
  ASSERT_EQ(p.status, DFM_OK) << dfm_last_error();
  EXPECT_NEAR(p.least([](const double *q) { return 0.6 * q[0] + 0.8 * q[2]; }), 0.8 * kGap, kClose);
}

TEST(Place, OnASphere_ItsFaceTouchesTheTop) {
  const Placed p(R"("shape": "sphere", "radius": 0.3)", R"({"position": [-0.1, -0.1, 1]})");
  ASSERT_EQ(p.status, DFM_OK) << dfm_last_error();
  EXPECT_NEAR(p.lowest(), 0.3 + kGap, kClose);
}

TEST(Place, WithGravityAlongY_LiesOnThatSide) {
  const Placed p(kBox, R"({"position": [0, 4, 0.4]})", R"(, "gravity": [0, -9.81, 0])");
  ASSERT_EQ(p.status, DFM_OK) << dfm_last_error();
  EXPECT_NEAR(p.least([](const double *q) { return q[1]; }), 1 + kGap, kClose);
}

TEST(Place, AWallOrAnObstacleBesideIt_IsRefused) {
  const Placed wall(R"("shape": "plane", "normal": [1, 0, 0])", "{}");
  EXPECT_EQ(wall.status, DFM_E_ARG);
  EXPECT_NE(std::string(dfm_last_error()).find("/bodies/0/place: 'table' is a wall"), std::string::npos)
      << dfm_last_error();
  const Placed beside(kBox, R"({"position": [2, 0, 0]})");
  EXPECT_EQ(beside.status, DFM_E_ARG);
  EXPECT_NE(std::string(dfm_last_error()).find("not above or below 'table'"), std::string::npos)
      << dfm_last_error();
}

// It neither falls onto it nor is thrown off: what happens within a tenth of a second is its own sag.
TEST(Place, WhatIsPlaced_RestsWithoutAThrow) {
  Placed p(kBox, "{}");
  ASSERT_EQ(p.status, DFM_OK) << dfm_last_error();
  dfm_world world = 0;
  test::ok(dfm_scene_world(p.scene, &world));
  uint32_t overlaps = 1;
  for (int i = 0; i < 20; ++i) test::ok(dfm_world_step(world, 0.001, nullptr));
  test::ok(dfm_world_overlaps(world, 0, nullptr, &overlaps));
  EXPECT_EQ(overlaps, 0u);
  dfm_body body = 0;
  test::ok(dfm_world_find_body(world, "cube", &body));
  dfm_body_measure m = {};
  m.size = sizeof m;
  test::ok(dfm_body_get_measure(body, &m));
  EXPECT_LT(std::fabs(m.velocity[2]), 9.81 * 0.02 * 1.01) << "no faster than it would fall";
}
