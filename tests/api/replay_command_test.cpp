// `deform run --save`, `--from`, `--record` and `deform replay`: the same bits after a break, from a file and
// in another process, and a sentence for what does not fit.
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>

#include "deform/deform.h"
#include "support.h"

namespace fs = std::filesystem;

namespace {

// A block that lands on a slope with friction that remembers, and changes its model on the way.
const char *kScene = R"({
  "format": "deform-scene", "version": 1,
  "time": {"duration": 0.12, "step": 0.0005},
  "materials": {"gel": {"density": 1000, "young": 50000, "poisson": 0.3,
    "damping": {"mass": 2, "stiffness": 0.002}}},
  "bodies": [{"name": "block", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.1], "cells": 60},
              "material": "gel", "pose": {"position": [0, 0, 0.005]}, "model": {"type": "msm"},
              "switch": [{"t": 0.09, "type": "corotational_fem"}]}],
  "obstacles": [{"name": "slope", "shape": "plane", "normal": [-0.2, 0, 1]}],
  "contact": {"friction": [{"between": ["*", "*"], "law": "lugre", "params": {"mu_C": 0.4, "mu_S": 0.4}}]},
  "output": {"every": 0.02}
})";

struct Folder {
  std::string path = test::scratch("replay"), scene = path + "/scene.json";
  Folder() { test::write_file(scene, kScene); }
  test::CommandResult run(std::vector<std::string> more) const {
    more.insert(more.begin(), {"run", scene, "--quiet"});
    return test::deform(more);
  }
  std::string hash(const std::string &out) const {
    const std::string text = test::read_file(path + "/" + out + "/summary.json");
    const size_t at = text.find("\"state_hash\"");
    return at == std::string::npos ? "" : text.substr(at, 33);
  }
};

}  // namespace

// unsanitized: too slow there; shorter tests run the same code
TEST(Replay, RunContinuedFromASavedState_EndsWithTheBitsOfOneThatNeverStopped) {
  const Folder f;
  // before the contact, in it, and after the change of model
  for (const char *at : {"0.01", "0.05", "0.1"}) {
    const std::string state = f.path + "/at" + at + ".state";
    const test::CommandResult whole = f.run({"--out", f.path + "/whole", "--save", at, state});
    ASSERT_EQ(whole.exit_code, 0) << whole.err;
    const test::CommandResult rest = f.run({"--out", f.path + "/rest", "--from", state});
    ASSERT_EQ(rest.exit_code, 0) << rest.err;
    EXPECT_FALSE(f.hash("whole").empty());
    EXPECT_EQ(f.hash("rest"), f.hash("whole")) << at;
  }
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Replay, RecordedRun_PassesThroughTheSameBitsInEveryState) {
  const Folder f;
  const std::string out = f.path + "/run";
  ASSERT_EQ(f.run({"--out", out, "--record", "--jitter", "7", "--set", "/materials/gel/young=4e4"}).exit_code,
            0);
  const test::CommandResult again = test::deform({"replay", out, "--threads", "2"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE(again.out.find("the same bits in all 7 recorded states"), std::string::npos) << again.out;
  EXPECT_TRUE(fs::exists(out + "/replay/summary.json"));
}

TEST(Replay, StateThatIsNotTheRecordedOne_IsReportedWithItsTimeAndExitsWith1) {
  const Folder f;
  const std::string out = f.path + "/run", index = out + "/recording/states.csv";
  ASSERT_EQ(f.run({"--out", out, "--record"}).exit_code, 0);
  std::string rows = test::read_file(index);
  const size_t third = rows.find("000002.state,") + 13;
  rows[third] = rows[third] == '0' ? '1' : '0';
  test::write_file(index, rows);
  const test::CommandResult again = test::deform({"replay", out});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_NE(again.err.find("at t = 0.04"), std::string::npos) << again.err;
  EXPECT_NE(test::read_file(out + "/replay/summary.json").find("\"simulated_s\": 0.04"), std::string::npos);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Replay, WhatDoesNotFit_IsReportedAndNothingIsLost) {
  const Folder f;
  const std::string state = f.path + "/mid.state", out = f.path + "/run";
  ASSERT_EQ(f.run({"--out", out, "--record", "--save", "0.05", state}).exit_code, 0);
  const std::string kept = test::read_file(state);
  const auto says = [](const test::CommandResult &r, const std::string &words) {
    EXPECT_EQ(r.exit_code, 2) << r.out;
    EXPECT_NE(r.err.find(words), std::string::npos) << r.err;
  };
  const std::string other = f.path + "/other";
  says(f.run({"--out", other, "--from", state, "--set", "/materials/gel/young=4e4"}), "another scene");
  says(f.run({"--out", other, "--from", state, "--time", "0.04"}), "give a longer --time");
  says(f.run({"--out", other, "--from", f.scene}), "not a state file");
  says(f.run({"--out", other, "--from", f.path + "/none"}), "cannot be opened");
  says(f.run({"--out", other, "--save", "0.05", f.path + "/none/x.state"}), "cannot be written there");
  says(f.run({"--out", other, "--save", "0.5", f.path + "/x.state"}), "the run ends at 0.12 s");
  says(f.run({"--out", other, "--save", "soon", f.path + "/x.state"}), "--save");
  test::write_file(f.path + "/cut.state", kept.substr(0, kept.size() - 9));
  says(f.run({"--out", other, "--from", f.path + "/cut.state"}), "cut short");
  std::string changed = kept;
  changed[kept.size() - 200] ^= 1;
  test::write_file(f.path + "/changed.state", changed);
  says(f.run({"--out", other, "--from", f.path + "/changed.state"}), "changed.state");
  const auto with_version = [&](const char *of, const char *name) {
    std::string text = kept;
    const size_t at = text.find(of) + std::string(of).size();
    text.replace(at, text.find('"', at) - at, "9.8.7");
    test::write_file(f.path + "/" + name, text);
    return f.run({"--out", other, "--from", f.path + "/" + name});
  };
  says(with_version("\"library\": \"", "library.state"),
       "written by version 9.8.7 of the library, and this is ");
  says(with_version("\"id\": \"org.deform.lugre\", \"version\": \"", "law.state"),
       "written with 'org.deform.lugre' 9.8.7, and ");
  says(test::deform({"replay", f.path}), "no recording in this folder");
  says(test::deform({"replay", out, "--set", "/time/step=1e-3"}), "only values under /output");
  says(test::deform({"replay", out, "--out", out + "/."}), "the folder of the recording");
  says(test::deform({"replay", out, "--states", "--out", out}), "the folder of the recording");
  EXPECT_TRUE(fs::exists(out + "/recording/000001.state"));
  EXPECT_EQ(test::read_file(state), kept);
  says(test::deform({"run", f.scene, "--set", "/time/mode=\"static\"", "--set", "/bodies/0/switch=[]",
                     "--out", other, "--save", "0.05", f.path + "/x.state"}),
       "equilibria");
  says(f.run({"--out", other + "/deep", "--save", "9", other + "/deep/x.state"}), "the run ends at");
  EXPECT_FALSE(fs::exists(other));
  const test::CommandResult pictures = test::deform({"replay", out, "--states", "--json"});
  EXPECT_TRUE(pictures.out.starts_with("{\"pictures\": 7, ") ||
              pictures.err.find("built without the renderer") != std::string::npos)
      << pictures.out << pictures.err;
  fs::rename(f.scene, f.path + "/moved.json");
  says(test::deform({"replay", out}), "recording/run.json");
}

// The folder of the run holds what an earlier run wrote, and the state to continue from.
TEST(Replay, RunIntoItsOwnFolder_ContinuesFromItsRecordingAndARefusedOneDeletesNothing) {
  const Folder f;
  const std::string out = f.path + "/own", recording = out + "/recording/000001.state";
  ASSERT_EQ(f.run({"--out", out, "--time", "0.03", "--record"}).exit_code, 0);
  const std::string summary = test::read_file(out + "/summary.json"), state = test::read_file(recording);
  fs::create_directory(f.path + "/folder.json");
  for (const std::vector<std::string> &refused :
       std::vector<std::vector<std::string>>{{"--save", "9", f.path + "/x.state"},
                                             {"--from", f.path + "/none"},
                                             {"--save-scene", f.path + "/scene.vtu"},
                                             {"--save-scene", f.path + "/folder.json"},
                                             {"--save", "0.01", f.scene},
                                             {"--save", "0.01", f.path},
                                             {"--stream", "rtp://:5004"},
                                             {"--stream", "rtp://127.0.0.1:5004?token=a"},
                                             {"--stream", "nowhere"}}) {
    std::vector<std::string> arguments = {"--out", out, "--time", "0.03"};
    arguments.insert(arguments.end(), refused.begin(), refused.end());
    EXPECT_EQ(f.run(arguments).exit_code, 2) << refused[0];
    EXPECT_EQ(test::read_file(out + "/summary.json"), summary) << refused[0];
    EXPECT_EQ(test::read_file(recording), state) << refused[0];
  }
  EXPECT_EQ(test::read_file(f.scene), kScene);
  const std::string hash = f.hash("own");
  const test::CommandResult rest = f.run({"--out", out, "--time", "0.03", "--from", recording});
  EXPECT_EQ(rest.exit_code, 0) << rest.err;
  EXPECT_EQ(f.hash("own"), hash);
}

// The model that a body has, the one that it changes to and its law, by version: neither the other plugins
// that are loaded nor what tells one build of them from another.
TEST(Replay, SavedState_NamesWhatTheSceneCallsByVersion) {
  const Folder f;
  fs::remove_all(f.path + "/run");
  const std::string state = f.path + "/run/mid.state";  // in a folder that the run makes
  ASSERT_EQ(f.run({"--out", f.path + "/run", "--save", "0.02", state}).exit_code, 0);
  const std::string text = test::read_file(state), head = text.substr(0, text.find('\n'));
  const std::string version = dfm_version(nullptr, nullptr, nullptr), row = R"(\{"id": "org.deform.)";
  const std::regex expected(R"(.*"library": ")" + version + R"(".*"plugins": \[)" + row +
                            R"(corotational_fem", "version": "[0-9.]+"\}, )" + row +
                            R"(lugre", "version": "[0-9.]+"\}, )" + row +
                            R"(msm", "version": "[0-9.]+"\}\].*)");
  EXPECT_TRUE(std::regex_match(head, expected)) << head;
}

TEST(Replay, StateOfALaterVersion_IsRefused) {
  const Folder f;
  const std::string state = f.path + "/mid.state";
  ASSERT_EQ(f.run({"--out", f.path + "/run", "--save", "0.02", state}).exit_code, 0);
  std::string text = test::read_file(state);
  const size_t at = text.find("\"version\"");
  text[text.find('1', at)] = '2';
  test::write_file(state, text);
  const test::CommandResult r = f.run({"--out", f.path + "/run", "--from", state});
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_NE(r.err.find("state format 2"), std::string::npos) << r.err;
}

TEST(SaveScene, RunContinuesFromIt_WithTheSameBitsProbesAndOutputs) {
  const Folder f;
  const std::string made = f.path + "/with a space/later.json";
  fs::create_directories(f.path + "/with a space");
  const std::vector<std::string> probe = {
      "--set", R"(/probes=[{"name": "top", "body": "block", "point": [0.05, 0.05, 0.1]}])"};
  const auto with_probe = [&](std::vector<std::string> more) {
    more.insert(more.end(), probe.begin(), probe.end());
    return f.run(more);
  };
  ASSERT_EQ(with_probe({"--out", f.path + "/whole"}).exit_code, 0);
  const test::CommandResult half =
      with_probe({"--out", f.path + "/half", "--time", "0.06", "--save-scene", made});
  ASSERT_EQ(half.exit_code, 0) << half.err;
  EXPECT_EQ(half.err, "");
  const test::CommandResult rest =
      test::deform({"run", made, "--quiet", "--out", f.path + "/rest", "--time", "0.06", "--from",
                    f.path + "/with a space/later_files/snapshot.state"});
  ASSERT_EQ(rest.exit_code, 0) << rest.err;
  EXPECT_FALSE(f.hash("whole").empty());
  EXPECT_EQ(f.hash("rest"), f.hash("whole"));
  const auto last_line = [&](const std::string &out) {
    const std::string text = test::read_file(f.path + "/" + out + "/probes.csv");
    return text.substr(text.rfind('\n', text.size() - 2) + 1);
  };
  EXPECT_NE(last_line("whole").find("top"), std::string::npos);
  EXPECT_EQ(last_line("rest"), last_line("whole"));
}

TEST(SaveScene, WrongNames_AreReportedBeforeTheFirstStep) {
  const Folder f;
  const auto refused = [&](const std::string &path, const char *part) {
    const test::CommandResult r = f.run({"--out", f.path + "/never", "--save-scene", path});
    EXPECT_EQ(r.exit_code, 2);
    EXPECT_NE(r.err.find("--save-scene " + path + ": "), std::string::npos) << r.err;
    EXPECT_NE(r.err.find(part), std::string::npos) << r.err;
    EXPECT_FALSE(fs::exists(f.path + "/never/summary.json")) << path;
  };
  refused(f.path + "/scene.vtu", "must end in .json");
  refused(f.path + "/no/such/scene.json", "cannot be written there");
  refused(f.scene, "give another name");
  refused(f.path + "/never/./summary.json", "give another name");
}
