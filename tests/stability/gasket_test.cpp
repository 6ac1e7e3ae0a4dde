// A gasket pressed between two plates: one implicit body on which hundreds of contacts bear, whose points all
// answer each other. Sweeps of contact do not agree on its loads (doc/decisions/contact_solver.md).
#include <fstream>

#include "scenes.h"

namespace {

const char *const kScene = R"({
  "format": "deform-scene", "version": 1,
  "time": {"duration": 0.02, "step": 0.001, "integrator": "tr_bdf2"},
  "materials": {"rubber": {"density": 1200, "young": 1e7, "poisson": 0.48, "damping": {"stiffness": 1e-4}}},
  "bodies": [{"name": "gasket", "material": "rubber", "pose": {"position": [0, 0, 0.0001]},
              "mesh": {"make": "tube", "cells": 2000, "inner": 0.03, "radius": 0.04, "length": 0.01}}],
  "obstacles": [{"name": "floor", "shape": "plane"},
                {"name": "plate", "shape": "box", "half_size": [0.1, 0.1, 0.01],
                 "motion": {"keyframes": [{"t": 0, "position": [0, 0, 0.02015]},
                                          {"t": 0.02, "position": [0, 0, 0.01995]}]}}]
})";

struct Pressed {
  std::string summary, out;
  double number(const std::string &key) const {
    const size_t at = summary.find("\"" + key + "\": ");
    return at == std::string::npos ? NAN : std::strtod(&summary[at + key.size() + 4], nullptr);
  }
};

Pressed press(const std::vector<std::string> &more = {}) {
  const std::string folder = test::scratch("gasket_" + std::to_string(getpid())), out = folder + "/out";
  std::ofstream(folder + "/gasket.json") << kScene;
  std::vector<std::string> arguments{"run", folder + "/gasket.json", "--out", out};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const test::CommandResult result = test::deform(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return {test::read_file(out + "/summary.json"), result.out};
}

std::string hash(const Pressed &p) { return p.summary.substr(p.summary.find("\"state_hash\": \""), 31); }

}  // namespace

// By sweeps alone 9 of 20 steps end unsolved, after up to 6,700 sweeps.
TEST(Gasket, StepsAreSolved) {
  const Pressed p = press();
  EXPECT_EQ(p.number("unconverged_steps"), 0);
  EXPECT_LE(p.number("sweeps"), 100) << "of one sub-step";
  EXPECT_EQ(p.number("inverted_max"), 0);
  EXPECT_GT(p.number("peak_N"), 100) << "it is not pressed";
}

// Of a body that only its contacts hold, what is left of their tolerance is more than it has to be right to:
// revisions that go on without a limit of their own take 34 passes, and sub-steps are taken anew.
TEST(Gasket, LongStepsTakeFewRevisions) {
  const Pressed p = press({"--set", "/time/step=0.01", "--set", "/time/duration=0.06"});
  EXPECT_EQ(p.number("unconverged_steps"), 0);
  EXPECT_LE(p.number("passes"), 20);
  EXPECT_LE(p.number("substeps"), 8);
  EXPECT_NE(p.out.find("of the time, with up to 456 points at once: fewer cells"), std::string::npos)
      << p.out;
  EXPECT_EQ(p.number("inverted_max"), 0);
}

TEST(Gasket, ThreadsChangeNoBit) { EXPECT_EQ(hash(press()), hash(press({"--threads", "3"}))); }
