// What a run says of loads that a body does not bear: its own weight, a heavy body on it, cells turned inside
// out.
#include <unistd.h>

#include "opened.h"

namespace {

// A cube of 10 cm and 981 Pa of own weight on a floor, and a rigid box that rests on it.
std::string said(double young, double mass, double duration = 0.6) {
  const std::string folder = test::scratch("pressed_flat_" + std::to_string(getpid()));
  test::write_file(folder + "/scene.json",
                   R"({"format": "deform-scene", "version": 1, "time": {"duration": )" +
                       std::to_string(duration) + R"(, "step": 0.005},
    "materials": {"gel": {"density": 1000, "young": )" +
                       std::to_string(young) + R"(, "damping": {"stiffness": 0.01}}},
    "bodies": [{"name": "bed", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.1], "cells": 100},
      "pose": {"position": [-0.05, -0.05, 0]}, "material": "gel"}],
    "obstacles": [{"name": "floor", "shape": "plane"}],
    "rigid": {"host": "builtin", "bodies": [{"name": "box", "shape": "box", "half_size": [0.05, 0.05, 0.02],
      "mass": )" + std::to_string(mass) +
                       R"(, "pose": {"position": [0, 0, 0.122]}}]}})");
  const test::CommandResult r = test::deform({"run", folder + "/scene.json", "--out", folder + "/out"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  return r.err;
}

}  // namespace

TEST(PressedFlat, HeavyBodyOnASoftOne_IsReportedWithAModulusThatHolds) {
  const std::string log = said(3000, 2.5, 2);  // 2453 Pa and half of its own weight; it bounces
  EXPECT_NE(log.find("body 'bed' is pressed flat"), std::string::npos) << log;
  EXPECT_NE(log.find("(\"young\": "), std::string::npos) << log;
  EXPECT_EQ(log.find("own weight"), std::string::npos) << log;
}

TEST(PressedFlat, WhatTheMaterialBears_IsNotReported) {
  EXPECT_EQ(said(30000, 2).find("pressed flat"), std::string::npos);
  EXPECT_EQ(said(10000, 0.5).find("pressed flat"), std::string::npos);
}

TEST(PressedFlat, InvertedCellsOfAnOverload_AreNoMatterOfTheMesh) {
  const std::string log = said(1500, 20, 0.3);
  ASSERT_NE(log.find("cells became inverted"), std::string::npos) << log;
  EXPECT_NE(log.find("too soft for the load"), std::string::npos) << log;
  EXPECT_EQ(log.find("refine the mesh"), std::string::npos) << log;
}

TEST(PressedFlat, OwnWeight_IsReportedWithAModulusThatHolds) {
  EXPECT_NE(said(1500, 0.1, 0.01).find("(\"young\": 9.8e+03 loses about 5 % of its height)"),
            std::string::npos);
}
