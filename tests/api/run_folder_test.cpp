// The folder of a run: one run at a time, nothing of an earlier one, no link followed; and text of others on
// its way to terminal and tables.
#include <gtest/gtest.h>

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>

#include "support.h"

namespace {

namespace fs = std::filesystem;

const std::string kScene =
    R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.002, "step": 0.001},
  "bodies": [{"name": "block", "mesh": ")" +
    std::string(DEFORM_SOURCE_DIR) + R"(/examples/data/block.msh"}]})";

std::string fresh(const std::string &name) {
  const std::string dir = test::scratch("run_folder_" + std::to_string(getpid())) + "/" + name;
  fs::remove_all(dir);
  fs::create_directories(dir);
  test::write_file(dir + "/scene.json", kScene);
  return dir;
}

test::CommandResult run(const std::string &dir, const std::vector<std::string> &more = {}) {
  std::vector<std::string> arguments = {"run", dir + "/scene.json", "--quiet", "--out", dir + "/out"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return test::deform(arguments);
}

// A run that does not end by itself, once it has begun to write.
pid_t start_endless(const std::string &dir) {
  const pid_t child = test::start(
      {DEFORM_COMMAND, "run", dir + "/scene.json", "--quiet", "--time", "1e9", "--out", dir + "/out"});
  for (int i = 0; i < 2000 && !fs::exists(dir + "/out/probes.csv"); ++i) usleep(10000);
  return child;
}

}  // namespace

TEST(RunFolder, SecondRunIntoIt_IsRefusedAndAKilledOneLetsGo) {
  const std::string dir = fresh("two");
  const pid_t first = start_endless(dir);
  ASSERT_TRUE(fs::exists(dir + "/out/probes.csv"));
  test::expect_refused(run(dir), {dir + "/out", "another run", "--out"});
  kill(first, SIGKILL);
  waitpid(first, nullptr, 0);
  EXPECT_EQ(run(dir).exit_code, 0);
}

TEST(RunFolder, KilledRerun_LeavesNoSummaryOfTheEarlierRunAndNoHalfFiles) {
  const std::string dir = fresh("killed");
  ASSERT_EQ(run(dir, {"--set", "/output/states=true"}).exit_code, 0);
  ASSERT_TRUE(fs::exists(dir + "/out/summary.json"));
  fs::remove(dir + "/out/probes.csv");  // start_endless waits for it
  const pid_t second = start_endless(dir);
  kill(second, SIGKILL);
  waitpid(second, nullptr, 0);
  EXPECT_FALSE(fs::exists(dir + "/out/summary.json"));
  EXPECT_TRUE(fs::is_empty(dir + "/out/states")) << "of the earlier run";
  for (const auto &entry : fs::recursive_directory_iterator(dir))
    EXPECT_EQ(entry.path().string().find(".part"), std::string::npos) << entry.path();
}

TEST(RunFolder, LeftoversOfKilledRuns_AreRemovedAndOtherFilesKept) {
  const std::string dir = fresh("leftovers");
  fs::create_directories(dir + "/out/states");
  fs::create_directories(dir + "/out/frames");
  fs::create_directories(dir + "/out/nodes");
  for (const char *name :
       {"summary.json.part", "summary.json.part12-3", "bodies.csv.part", "states/block_000003.vtu.part77-0",
        "states/last_block.vtu", "frames/frame_000001.png.part12", "frames/frame_000001.png",
        "nodes/ghost.csv", "contacts.csv"})
    test::write_file(dir + "/out/" + name, "old");
  test::write_file(dir + "/out/bodies.csv", "");  // which tells that a run was here
  for (const char *name : {"notes.txt", "states/own.vtu", "frames/film.mp4", "my_table.csv"})
    test::write_file(dir + "/out/" + name, "own");
  ASSERT_EQ(run(dir, {"--set", "/output/contacts=false"}).exit_code, 0);
  size_t files = 0;
  for (const auto &entry : fs::recursive_directory_iterator(dir + "/out")) {
    if (!entry.is_regular_file()) continue;
    ++files;
    EXPECT_NE(test::read_file(entry.path()), "old") << entry.path();
  }
  EXPECT_EQ(files, 7u) << "three of the run, four of the user";
}

TEST(RunFolder, FilesThatNoRunWrote_AreKept) {
  const std::string dir = fresh("foreign");
  fs::create_directories(dir + "/out/nodes");
  for (const std::string name : {"/out/bodies.csv", "/out/nodes/measured.csv"}) {
    test::write_file(dir + name, "t,x\n0,1\n");
    test::expect_refused(run(dir), {dir + name, "no run wrote", "--out"});
    EXPECT_EQ(test::read_file(dir + name), "t,x\n0,1\n");
    fs::remove(dir + name);
  }
  EXPECT_EQ(run(dir).exit_code, 0);
}

TEST(RunFolder, OfAStudyThatRuns_IsHeld) {
  const std::string dir = fresh("study");
  fs::create_directories(dir + "/out");
  const int held = open((dir + "/out").c_str(), O_RDONLY | O_DIRECTORY);
  ASSERT_EQ(flock(held, LOCK_EX), 0);
  test::expect_refused(test::deform({"cost", dir + "/scene.json", "--budget", "1", "--out", dir + "/out"}),
                       {dir + "/out", "another run"});
  close(held);
}

TEST(RunFolder, WhatCannotBeWritten_EndsWithASentence) {
  const std::string dir = fresh("full"), command = DEFORM_COMMAND, scene = "'" + dir + "/scene.json'";
  const auto shell = [](const std::string &words) { return test::run({"/bin/sh", "-c", words}); };
  test::expect_refused(shell("'" + command + "' explain " + scene + " > /dev/full"), {"standard output"});
  test::expect_refused(shell("ulimit -f 1; exec '" + command + "' run " + scene +
                             " --quiet --time 0.1 --out '" + dir + "/out'"),
                       {"cannot be written"});
  test::expect_refused(run(dir, {"--jitter", "-1"}), {"--jitter", "a whole number, 0 or more"});
}

TEST(RunFolder, SummaryOfASceneWhoseNameIsNoUtf8_IsJson) {
  const std::string dir = fresh("name"), scene = dir + "/n\xff.json";
  test::write_file(scene, kScene);
  ASSERT_EQ(test::deform({"run", scene, "--quiet", "--out", dir + "/out"}).exit_code, 0);
  const std::string summary = test::read_file(dir + "/out/summary.json");
  EXPECT_NE(summary.find("n?.json"), std::string::npos);
  EXPECT_EQ(summary.find('\xff'), std::string::npos);
}

TEST(RunFolder, LinksInItsPlace_AreReplacedAndNotFollowed) {
  const std::string dir = fresh("links");
  fs::create_directories(dir + "/out");
  const std::vector<std::string> names = {"bodies.csv", "contacts.csv", "probes.csv", "summary.json",
                                          "summary.json.part"};
  const std::string precious = R"({"format": "deform-summary"})";
  for (const std::string &name : names) {
    test::write_file(dir + "/victim_" + name, precious);
    fs::create_symlink(dir + "/victim_" + name, dir + "/out/" + name);
  }
  ASSERT_EQ(run(dir).exit_code, 0);
  for (const std::string &name : names) EXPECT_EQ(test::read_file(dir + "/victim_" + name), precious) << name;
  for (const char *name : {"bodies.csv", "contacts.csv", "probes.csv", "summary.json"})
    EXPECT_FALSE(fs::is_symlink(dir + "/out/" + name)) << name;
}

TEST(RunFolder, LinkToAnotherFolderInIt_IsRefused) {
  for (const std::string name : {"states", "nodes", "frames"}) {
    const std::string dir = fresh("linked_" + name);
    fs::create_directories(dir + "/out");
    fs::create_directories(dir + "/other");
    const std::vector<std::string> files = {"/other/b_000000.vtu", "/other/last_b.vtu", "/other/index.csv",
                                            "/other/frame_000000.png", "/out/summary.json"};
    for (const std::string &file : files) test::write_file(dir + file, "precious");
    fs::create_directory_symlink(dir + "/other", dir + "/out/" + name);
    test::expect_refused(run(dir, {"--set", "/output/states=true"}), {"/out/" + name, "a link", "--out"});
    for (const std::string &file : files) EXPECT_EQ(test::read_file(dir + file), "precious") << file;
  }
}

TEST(SceneText, BytesBehindANul_AreRefused) {
  const std::string dir = fresh("nul");
  test::write_file(dir + "/scene.json", kScene + std::string(1, '\0') + "{\"time\": 7}");
  test::expect_refused(run(dir), {"scene.json:2:", "NUL"});
  test::write_file(dir + "/case.json", "{\"law\": \"coulomb\"}" + std::string(1, '\0'));
  test::expect_refused(test::deform({"friction", dir + "/case.json"}), {"case.json:1: this is not JSON"});
}

// `deform mesh from-labels` calls each scene scene.json: without --out each goes by its folder's name, and
// what has another name by its own.
TEST(RunFolder, ScenesOfOneName_DoNotShareTheDefaultFolder) {
  const std::string dir = fresh("defaults");
  for (const char *scene : {"liver/scene.json", "kidney/scene.json", "kidney/block.json"}) {
    fs::create_directories(fs::path(dir + "/" + scene).parent_path());
    test::write_file(dir + "/" + scene, kScene);
  }
  const fs::path before = fs::current_path();
  fs::current_path(dir);
  for (const char *scene : {"liver/scene.json", "./kidney/../kidney/scene.json", "kidney/block.json"})
    EXPECT_EQ(test::deform({"run", scene, "--quiet"}).exit_code, 0) << scene;
  fs::current_path(dir + "/liver");
  EXPECT_EQ(test::deform({"run", "scene.json", "--quiet"}).exit_code, 0);
  fs::current_path(before);
  for (const char *out : {"out/liver_run", "out/kidney_run", "out/block", "liver/out/liver_run"})
    EXPECT_TRUE(fs::exists(dir + "/" + out + "/summary.json")) << out;
  EXPECT_FALSE(fs::exists(dir + "/out/scene"));
}

TEST(SceneText, KeysDoubledByEscapes_AreRefused) {
  const std::string dir = fresh("doubled");
  std::string twice = kScene;
  twice.insert(1, R"("gravity": [0, 0, 1], "gr\u0061vity": [0, 0, -1], )");
  test::write_file(dir + "/scene.json", twice);
  test::expect_refused(run(dir), {"scene.json:1:", "\"gravity\" is given twice"});
  test::expect_refused(run(fresh("doubled"), {"--set", R"(/time={"step": 1, "\u0073tep": 2})"}),
                       {"given twice"});
  test::write_file(dir + "/case.json", R"({"law": "coulomb", "l\u0061w": "dahl"})");
  test::expect_refused(test::deform({"friction", dir + "/case.json"}), {"case.json:1:", "given twice"});
}

TEST(Terminal, ControlCharactersOfNamesAndPaths_AreShownAndNotSent) {
  const std::string dir = fresh("control");
  std::string scene = kScene;
  scene.insert(1, R"("\u001b[2J\nred\u009b": 1, )");
  test::write_file(dir + "/scene.json", scene);
  test::expect_refused(run(dir), {"\\u001b[2J\\u000ared"});
  const std::string path = dir + "/a\x1b[31m\nb.obj";
  test::write_file(path, "v 0 0 0\n");
  test::expect_refused(test::deform({"mesh", "info", path}), {"a\\u001b[31m\\u000ab.obj"});
  const test::CommandResult made =
      test::deform({"mesh", "make", "ball", "--surface", "--cells", "100", "--out", path});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const test::CommandResult info = test::deform({"mesh", "info", path});
  EXPECT_EQ(info.out.find('\x1b'), std::string::npos) << info.out;
  EXPECT_EQ(run(fresh("named"), {"--set", "/bodies/0/name=\"a\u009bb\""}).exit_code, 2);
}
