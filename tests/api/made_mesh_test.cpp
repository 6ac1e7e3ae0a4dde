// A body's mesh that is made and not read: the scene key {"make": ...}.
#include <gtest/gtest.h>

#include "support.h"

namespace {

std::string scene_of(const std::string &mesh) {
  return R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.002, "step": 0.001},
    "gravity": [0, 0, -9.81],
    "bodies": [{"name": "b", "mesh": )" +
         mesh + R"(, "spin": [1, 2, 3]}], "output": {"every": 1}})";
}

// The output in the terminal without the name of the folder, and the hash of the state.
struct Outcome {
  test::CommandResult result;
  std::string hash;
};
Outcome run(const std::string &folder, const std::string &mesh) {
  test::write_file(folder + "/scene.json", scene_of(mesh));
  Outcome r{test::deform({"run", folder + "/scene.json", "--quiet", "--out", folder + "/out"}), ""};
  const std::string summary = test::read_file(folder + "/out/summary.json"), key = "\"state_hash\": \"";
  const size_t at = summary.find(key);
  if (r.result.exit_code == 0 && at != std::string::npos) r.hash = summary.substr(at + key.size(), 16);
  return r;
}

}  // namespace

TEST(MadeMesh, OfAScene_IsTheOneThatMeshMakeWrites) {
  const std::string folder = test::scratch("made_mesh");
  const struct {
    const char *mesh;
    std::vector<std::string> arguments;
  } shapes[] = {{R"({"make": "cylinder", "radius": 0.02, "length": 0.16, "cells": 300})",
                 {"cylinder", "--radius", "0.02", "--length", "0.16"}},
                {R"({"make": "tube", "inner": 0.01, "radius": 0.02, "length": 0.16, "cells": 300})",
                 {"tube", "--inner", "0.01", "--radius", "0.02", "--length", "0.16"}},
                {R"({"make": "ball", "radius": 0.05, "cells": 300})", {"ball", "--radius", "0.05"}},
                {R"({"make": "beam", "size": [0.3, 0.1, 0.2], "cells": 300})",
                 {"beam", "--size", "0.3", "0.1", "0.2"}}};
  std::vector<std::string> hashes;
  for (const auto &shape : shapes) {
    std::vector<std::string> arguments{"mesh", "make"};
    arguments.insert(arguments.end(), shape.arguments.begin(), shape.arguments.end());
    arguments.insert(arguments.end(), {"--cells", "300", "--quiet", "--out", folder + "/file.msh"});
    ASSERT_EQ(test::deform(arguments).exit_code, 0);
    const Outcome made = run(folder, shape.mesh), read = run(folder, "\"file.msh\"");
    EXPECT_EQ(made.result.exit_code, 0) << made.result.err;
    EXPECT_NE(made.hash, "");
    EXPECT_EQ(made.hash, read.hash) << shape.mesh;
    hashes.push_back(made.hash);
  }
  EXPECT_NE(hashes[0], hashes[1]);
  const Outcome usual = run(folder, R"({"make": "ball", "radius": 0.05})");
  const Outcome said = run(folder, R"({"make": "ball", "radius": 0.05, "cells": 1000})");
  EXPECT_EQ(usual.hash, said.hash);
}

TEST(MadeMesh, WhatDoesNotFit_IsRefusedWithItsPointer) {
  const std::string folder = test::scratch("made_mesh_refused");
  const struct {
    const char *mesh, *pointer, *word;
  } cases[] = {
      {R"({"radius": 0.1})", "/bodies/0/mesh", "make"},
      {R"({"make": "cube", "size": [1, 1, 1]})", "/bodies/0/mesh/make", "tube"},
      {R"({"make": "ball"})", "/bodies/0/mesh", "radius"},
      {R"({"make": "ball", "radius": 0})", "/bodies/0/mesh/radius", "0"},
      {R"({"make": "ball", "radius": 0.1, "length": 1})", "/bodies/0/mesh/length", "ball"},
      {R"({"make": "cylinder", "radius": 0.1})", "/bodies/0/mesh", "length"},
      {R"({"make": "tube", "inner": 0.1, "radius": 0.1, "length": 1})", "/bodies/0/mesh/inner", "0.1"},
      {R"({"make": "beam", "size": [0.1, 0, 0.1]})", "/bodies/0/mesh/size", "above 0"},
      {R"({"make": "beam", "size": [0.1, 0.1, 0.1], "radius": 0.1})", "/bodies/0/mesh/radius", "beam"},
      {R"({"make": "ball", "radius": 0.1, "cells": 0})", "/bodies/0/mesh/cells", "whole number"},
      {R"({"make": "ball", "radius": 0.1, "cells": 10.5})", "/bodies/0/mesh/cells", "whole number"},
      {R"({"make": "ball", "radius": 0.1, "color": 1})", "/bodies/0/mesh", "color"}};
  for (const auto &c : cases) {
    const Outcome r = run(folder, c.mesh);
    EXPECT_EQ(r.result.exit_code, 2) << c.mesh;
    EXPECT_NE(r.result.err.find(c.pointer), std::string::npos) << c.mesh << ": " << r.result.err;
    EXPECT_NE(r.result.err.find(c.word), std::string::npos) << c.mesh << ": " << r.result.err;
  }
}
