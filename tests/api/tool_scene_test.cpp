// The key "tools" of scenes: shapes, keyframes, a recorded hand, couplings, and what is refused.
#include <unistd.h>

#include "opened.h"

namespace {

std::string folder() { return test::scratch("tool scene " + std::to_string(getpid())); }

std::string scene(const std::string &tools, const std::string &body = "") {
  return R"({"format": "deform-scene", "version": 1, "gravity": [0, 0, 0],
    "time": {"duration": 0.1, "step": 0.001, "integrator": "symplectic_euler"},
    "materials": {"gel": {"young": 3e4, "damping": {"stiffness": 0.002}}, "steel": {"young": 1e6}},
    "bodies": [{"name": "block", "mesh": {"make": "beam", "size": [0.04, 0.04, 0.04], "cells": 100},
      "material": "gel", "pose": {"position": [-0.02, -0.02, -0.02]})" +
         body + R"(}], "tools": )" + tools + "}";
}

struct Opened : test::Opened {
  explicit Opened(const std::string &text, const std::string &path = folder() + "/scene.json")
      : test::Opened(text.empty() ? path : test::written(path, text)) {}
  dfm_tool_state state(const char *name) const {
    dfm_tool tool = 0;
    test::ok(dfm_world_find_tool(world, name, &tool));
    dfm_tool_state s{};
    s.size = sizeof s;
    test::ok(dfm_tool_get_state(tool, &s));
    return s;
  }
};

constexpr double kDegree = 0.017453292519943295;

}  // namespace

TEST(ToolScene, EveryShape_GoesByItsKeys) {
  const Opened s(scene(R"([
    {"name": "ball", "shape": "sphere", "radius": 0.005, "pose": {"position": [0, 0, 0.1]}},
    {"name": "pin", "shape": "capsule", "radius": 0.002, "half_length": 0.01,
     "pose": {"position": [0, 0, 0.2]},
     "coupling": {"stiffness": 300, "turn_stiffness": 0.2, "damping": 0.5, "passive": true},
     "motion": {"keyframes": [{"t": 0, "position": [0, 0, 0.2]}, {"t": 0.1, "position": [0, 0, 0.25]}]}},
    {"name": "knife", "shape": "blade", "half_size": [0.001, 0.01, 0.005], "pose": {"position": [0, 0, 0.3]}},
    {"name": "egg", "shape": "ellipsoid", "half_size": [0.01, 0.02, 0.01], "pose": {"position": [0, 0, 0.4]}},
    {"name": "brick", "shape": "box", "half_size": [0.01, 0.02, 0.01], "pose": {"position": [0, 0, 0.5]}},
    {"name": "jaws", "shape": "grasper", "half_size": [0.001, 0.003, 0.01], "radius": 0.002,
     "half_length": 0.02, "material": "steel", "pose": {"position": [0.2, 0, 0]},
     "opening_deg": {"keyframes": [{"t": 0, "value": 40}, {"t": 0.1, "value": 20}]}},
    {"name": "shears", "shape": "scissors", "half_size": [0.001, 0.001, 0.01], "opening_deg": 30,
     "pose": {"position": [0.3, 0, 0]}}])"));
  ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
  EXPECT_EQ(test::listed(dfm_world_tools, s.world).size(), 7u);
  test::run(s.world, 0.05, 1e-3);
  EXPECT_NEAR(s.state("pin").device.position[2], 0.225, 1e-12);
  EXPECT_NEAR(s.state("jaws").opening, 30 * kDegree, 1e-12);
  EXPECT_NEAR(s.state("shears").opening, 30 * kDegree, 1e-12);
  dfm_tool pin = 0;
  test::ok(dfm_world_find_tool(s.world, "pin", &pin));
  dfm_tool_def d{};
  d.size = sizeof d;
  test::ok(dfm_tool_get_def(pin, &d));
  EXPECT_EQ(d.flags, uint32_t(DFM_TOOL_PASSIVE));
  EXPECT_EQ(d.mass, 0.05);
  for (const char *part : {"jaws", "jaws.left", "jaws.right", "jaws.shaft", "egg.shape"}) {
    dfm_obstacle o = 0;
    EXPECT_EQ(dfm_world_find_obstacle(s.world, part, &o), DFM_OK) << dfm_last_error();
  }
}

TEST(ToolScene, ARecordedHand_LeadsTool_AndJaws) {
  test::write_file(folder() + "/my hand.csv",
                   "t,x,y,z,qx,qy,qz,qw,opening_deg\n0,0,0,0.1,0,0,0,1,60\n0.02,0,0.01,0.1,0,0,0,1,50\n"
                   "0.04,0,0.01,0.08,0,0,1,1,20\n");
  const char *const tools = R"([{"name": "jaws", "shape": "grasper", "half_size": [0.001, 0.003, 0.01],
    "motion": {"file": "my hand.csv"}}])";
  const Opened s(scene(tools));
  ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
  EXPECT_NEAR(s.state("jaws").opening, 60 * kDegree, 1e-12) << "as the file begins";
  test::run(s.world, 0.03, 1e-3);
  const dfm_tool_state now = s.state("jaws");
  EXPECT_NEAR(now.pose.position[2], 0.09, 1e-12);
  EXPECT_NEAR(now.opening, 35 * kDegree, 1e-12);
  EXPECT_NEAR(now.pose.rotation[2], std::sin(22.5 * kDegree), 1e-9);
  EXPECT_EQ(now.nkeys, 1u);
}

TEST(ToolScene, WhatIsWrong_IsNamed) {
  const auto refused = [](const std::string &tools, std::initializer_list<const char *> parts) {
    const Opened s(scene(tools));
    EXPECT_LT(s.status, 0) << tools;
    test::says(parts);
  };
  refused(R"([{"name": "a", "shape": "sphere"}])", {"/tools/0", "radius"});
  refused(R"([{"name": "a", "shape": "spere", "radius": 1}])", {"/tools/0/shape", "sphere"});
  refused(R"([{"name": "a", "shape": "sphere", "radius": 0.01, "half_size": [1, 1, 1]}])",
          {"/tools/0/half_size", "sphere"});
  refused(R"([{"name": "block", "shape": "sphere", "radius": 0.01}])", {"block"});
  refused(R"([{"name": "a", "shape": "sphere", "radius": 0.01, "opening_deg": 10}])", {"opening_deg"});
  refused(R"([{"name": "a", "shape": "sphere", "radius": 0.01, "motion": {}}])", {"keyframes", "file"});
  refused(R"([{"name": "a", "shape": "sphere", "radius": 0.01, "coupling": {"stiffness": 1}}])",
          {"turn_stiffness"});
  refused(R"([{"name": "a", "shape": "mesh", "mesh": "none.obj"}])", {"none.obj"});
  refused(R"([{"name": "a", "shape": "sphere", "radius": 0.01, "motion": {"file": "none.csv"}}])",
          {"/tools/0/motion/file", "none.csv"});
  const auto hand = [&](const std::string &text, std::initializer_list<const char *> parts) {
    test::write_file(folder() + "/h.csv", text);
    refused(R"([{"name": "a", "shape": "sphere", "radius": 0.01, "motion": {"file": "h.csv"}}])", parts);
  };
  hand("t,x,y\n", {"h.csv:1", "t,x,y,z,qx,qy,qz,qw"});
  hand("t,x,y,z,qx,qy,qz,qw\n", {"no rows"});
  hand("t,x,y,z,qx,qy,qz,qw\n0,0,0,1,0,0,0,1\n0,0,0,1,0,0,0,1\n", {"h.csv:3", "times must increase"});
  hand("t,x,y,z,qx,qy,qz,qw\n0,0,0,1,0,0,0,0\n", {"h.csv:2", "quaternion"});
  hand("t,x,y,z,qx,qy,qz,qw\n0,0,0,one,0,0,0,1\n", {"h.csv:2", "one"});
}

// The shipped scene: lifted by friction alone, twisted and carried along.
// unsanitized: too slow there; shorter tests run the same code
TEST(ToolScene, Grasp_LiftsTheStrip) {
  const std::string out = folder() + "/out";
  const test::CommandResult r = test::deform(
      {"run", DEFORM_SOURCE_DIR "/examples/scenes/grasp.json", "--time", "1.6", "--out", out, "--quiet"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const auto bodies = test::read_csv(out + "/bodies.csv");
  const auto tools = test::read_csv(out + "/tools.csv");
  ASSERT_GT(tools.size(), 30u);
  EXPECT_EQ(tools[0][1], "tool");
  size_t z = 0, fz = 0;
  for (size_t i = 0; i < bodies[0].size(); ++i)
    if (bodies[0][i] == "com_z") z = i;
  for (size_t i = 0; i < tools[0].size(); ++i)
    if (tools[0][i] == "fz") fz = i;
  ASSERT_TRUE(z && fz);
  EXPECT_NEAR(std::stod(bodies.back()[z]) - std::stod(bodies[1][z]), 0.04, 0.006) << "as far as the hand";
  const double weight = 9.81 * 1000 * 0.016 * 0.02 * 0.06;
  EXPECT_NEAR(std::stod(tools.back()[fz]), -weight, 0.3 * weight);
}
