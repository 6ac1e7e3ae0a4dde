// `deform run --contact-problems`: which problems are written, and that writing them changes nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "deform/deform.h"
#include "support.h"

namespace fs = std::filesystem;

namespace {

// Two blocks on each other, one of them implicit, with a law that remembers.
const char *kScene = R"({
  "format": "deform-scene", "version": 1,
  "time": {"duration": 0.05, "step": 0.001},
  "materials": {"gel": {"density": 1000, "young": 50000, "poisson": 0.3}},
  "bodies": [
    {"name": "low", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.1], "cells": 60}, "material": "gel",
     "pose": {"position": [0, 0, 0.0001]}, "model": {"type": "corotational_fem"},
     "integrator": "implicit_euler"},
    {"name": "high", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.1], "cells": 60}, "material": "gel",
     "pose": {"position": [0.01, 0.02, 0.1004]}, "model": {"type": "msm"}}],
  "obstacles": [{"name": "floor", "shape": "plane", "normal": [0, 0, 1]}],
  "contact": {"friction": [{"between": ["*", "*"], "law": "coulomb"},
                           {"between": ["low", "floor"], "law": "lugre"}]}
})";

struct Folder {
  std::string path = test::scratch("contact_problems"), scene = path + "/scene.json";
  Folder() { test::write_file(scene, kScene); }
  // The state at the end.
  std::string run(std::vector<std::string> more) const {
    more.insert(more.begin(), {"run", scene, "--quiet", "--out", path + "/out"});
    const test::CommandResult r = test::deform(more);
    EXPECT_EQ(r.exit_code, 0) << r.err;
    const std::string text = test::read_file(path + "/out/summary.json");
    return text.substr(text.find("\"state_hash\""), 33);
  }
  std::vector<std::string> problems(const std::string &in) const {
    std::vector<std::string> names;
    for (const auto &file : fs::directory_iterator(path + "/" + in))
      names.push_back(file.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }
};

}  // namespace

TEST(ContactProblems, EveryThirdAndUnsolvedOnes_AreWrittenAndTheRunHasTheSameBits) {
  const Folder f;
  const std::string hash = f.run({});
  EXPECT_EQ(f.run({"--contact-problems", f.path + "/every", "--contact-problems-every", "3"}), hash);
  const std::vector<std::string> every = f.problems("every");
  EXPECT_GE(every.size(), 10u);
  for (const std::string &name : every) EXPECT_TRUE(name.ends_with(".contact")) << name;
  EXPECT_EQ(f.run({"--contact-problems", f.path + "/unsolved"}), hash);
  EXPECT_EQ(f.problems("unsolved").size(), 0u);
}

TEST(ContactProblems, ToleranceThatNoSolveReaches_LeavesUnsolvedProblems) {
  const Folder f;
  f.run({"--set", "/contact/tolerance=1e-40", "--time", "0.03", "--contact-problems", f.path + "/strict"});
  const std::vector<std::string> strict = f.problems("strict");
  EXPECT_GE(strict.size(), 1u);
  for (const std::string &name : strict) EXPECT_TRUE(name.ends_with("-unsolved.contact")) << name;
}

// Rows between rigid bodies are part of a problem whose soft body they rest on.
TEST(ContactProblems, StackOfRigidBoxesOnABlock_IsWrittenAndSolvedAgain) {
  const Folder f;
  f.run({"--set", "/time/duration=0.2", "--set", "/time/step=0.01", "--set",
         R"(/rigid={"host": "builtin", "bodies": [
           {"name": "light", "shape": "box", "half_size": [0.03, 0.03, 0.02], "mass": 0.05,
            "pose": {"position": [0.06, 0.07, 0.2208]}},
           {"name": "heavy", "shape": "box", "half_size": [0.03, 0.03, 0.02], "mass": 2,
            "pose": {"position": [0.06, 0.07, 0.2612]}}]})",
         "--contact-problems", f.path + "/stack", "--contact-problems-every", "5"});
  EXPECT_GE(f.problems("stack").size(), 3u);
  // the program is built where the library of HDF5 is
  if (!fs::exists(std::string(DEFORM_BINARY_DIR) + "/bin/deform-contact")) return;
  const test::CommandResult r = test::deform({"contact", f.path + "/stack", "--json"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_EQ(r.out.find("\"solved\": false"), std::string::npos) << r.out;
}

TEST(ContactProblems, EveryWithoutAFolder_IsRefused) {
  const Folder f;
  const test::CommandResult r = test::deform({"run", f.scene, "--contact-problems-every", "3"});
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_NE(r.err.find("needs --contact-problems DIR"), std::string::npos) << r.err;
}

// In /proc no file can be made.
TEST(ContactProblems, FolderThatTakesNoFiles_EndsTheWritingAndNotTheRun) {
  const Folder f;
  const test::CommandResult r = test::deform({"run", f.scene, "--out", f.path + "/out", "--contact-problems",
                                              "/proc", "--contact-problems-every", "1"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  const size_t at = r.err.find("no more contact problems are written: ");
  EXPECT_LT(at, r.err.size()) << r.err;
  EXPECT_EQ(r.err.find("no more contact problems", at + 1), std::string::npos) << r.err;
}

TEST(ContactProblems, CallOfTheLibrary_SaysWhatWritesThem) {
  EXPECT_EQ(dfm_debug_contact_problems(0, nullptr, 0), DFM_OK);
  EXPECT_EQ(dfm_debug_contact_problems(0, "folder", 0), DFM_E_UNSUPPORTED);
  EXPECT_NE(std::string(dfm_last_error()).find("--contact-problems"), std::string::npos);
}
