// The friction benchmark (tests/bench/friction) as a stranger meets it: rows of CSV, judged, continued
// where they stopped.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>

#include "support.h"

namespace {

std::string script(const char *name) {
  return std::string(DEFORM_SOURCE_DIR) + "/tests/bench/friction/" + name;
}

}  // namespace

// unsanitized: too slow there; shorter tests run the same code
TEST(FrictionBenchmark, OurSlides_AreMeasuredJudgedAndNotRunTwice) {
  const std::string out = test::scratch("friction_benchmark") + "/rows.csv";
  std::remove(out.c_str());
  const std::vector<std::string> call = {
      DEFORM_TEST_PYTHON, script("run.py"), "deform", "--command", DEFORM_COMMAND, "--only", "slope_slide",
      "--configuration",  "coulomb",        "--out",  out};
  const test::CommandResult first = test::run(call);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const auto rows = test::read_csv(out);
  ASSERT_EQ(rows.size(), 3u);  // header, mu 0.2 and 0.5
  const auto column = [&](const char *name) {
    return size_t(std::find(rows[0].begin(), rows[0].end(), name) - rows[0].begin());
  };
  for (size_t i = 1; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i][column("verdict")], "pass") << first.out;
    const double measured = std::stod(rows[i][column("measured")]);
    const double expected = std::stod(rows[i][column("expected")]);
    EXPECT_NEAR(measured, expected, 0.01 * expected);
  }
  EXPECT_NE(rows[1][column("parameters")], rows[2][column("parameters")]);
  const test::CommandResult again = test::run(call);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(again.out, "");
  EXPECT_EQ(test::read_csv(out).size(), 3u);
}

// A stranger's engine: a file in a folder of its own, as the README tells it. What goes wrong and what takes
// too long are rows, not ends.
TEST(FrictionBenchmark, EntryFromOutside_GetsItsRows) {
  const std::string folder = test::scratch("friction_benchmark_entry");
  test::write_file(folder + "/entry_sled.py", R"(import cases
class Entry:
    name, version = "sled", "1"
    def __init__(self, command, work):
        pass
    def configurations(self, case):
        return ["good", "slow", "broken"] if case["name"] == "slope_slide" else []
    def why_not(self, case):
        return "it only slides"
    def run(self, case, configuration):
        if configuration == "slow":
            raise cases.TooSlow(0.5, 2)
        if configuration == "broken":
            raise RuntimeError("the string broke")
        return {"acceleration": case["answer"]["acceleration"][0]}, 0.25
)");
  const std::string out = folder + "/rows.csv";
  std::remove(out.c_str());
  const auto call = [&](const char *engine) {
    return test::run({DEFORM_TEST_PYTHON, script("run.py"), engine, "--entries", folder, "--command",
                      DEFORM_COMMAND, "--out", out});
  };
  const test::CommandResult done = call("sled");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  std::map<std::string, int> verdicts;
  std::string notes;
  const auto rows = test::read_csv(out);
  for (size_t i = 1; i < rows.size(); ++i) {
    ++verdicts[rows[i].at(10)];
    notes += rows[i].back() + "\n";
  }
  EXPECT_EQ(verdicts["pass"], 2);
  EXPECT_EQ(verdicts["too_slow"], 2);
  EXPECT_EQ(verdicts["error"], 2);
  EXPECT_GT(verdicts["not_run"], 10);
  for (const char *said : {"too slow: > 300 s for 0.5 of 2 s", "the string broke", "it only slides"})
    EXPECT_NE(notes.find(said), std::string::npos) << said;

  const test::CommandResult unknown = call("sledge");
  EXPECT_NE(unknown.exit_code, 0);
  EXPECT_NE(unknown.err.find("there is no entry_sledge.py"), std::string::npos) << unknown.err;
  EXPECT_NE(unknown.err.find("bullet, deform, mujoco, sled"), std::string::npos) << unknown.err;
}

// Within the bands the cheaper is better, outside them the nearer; a trial that fails is the worst. A row for
// every trial, none run twice; the best runs as a configuration of its own.
// unsanitized: too slow there; shorter tests run the same code
TEST(FrictionBenchmark, Search_FindsTheBestSettingsWhichRunThen) {
  const std::string folder = test::scratch("friction_benchmark_search");
  test::write_file(folder + "/entry_tunable.py", R"(class Entry:
    name, version, settings = "tunable", "1", {"plain": {"a": 1}}
    SEARCH = {"a": [1, 2, 3], "b": [None, 2, 3]}
    def __init__(self, command, work):
        pass
    def configurations(self, case):
        return ["plain"] if case["name"] == "slope_slide" else []
    def run(self, case, configuration):
        s = self.settings[configuration]
        if s.get("b") == 3:
            raise RuntimeError("it fell apart")
        error = 0.1 * abs(s["a"] - 2)
        return {"acceleration": case["answer"]["acceleration"][0] + error}, 1.0 / s.get("b", 1)
)");
  const std::string out = folder + "/trials.csv", rows = folder + "/rows.csv";
  std::remove(out.c_str());
  std::remove(rows.c_str());
  const auto call = [&](const char *name, std::vector<std::string> more) {
    std::vector<std::string> line = {DEFORM_TEST_PYTHON, script(name),  "tunable", "--entries", folder,
                                     "--command",        DEFORM_COMMAND};
    line.insert(line.end(), more.begin(), more.end());
    return test::run(line);
  };
  const auto search = [&](const char *trials) {
    return call("search.py",
                {"--only", "slope_slide", "--parameters", "mu=0.2", "--trials", trials, "--out", out});
  };
  const test::CommandResult stopped = search("3");
  ASSERT_EQ(stopped.exit_code, 0) << stopped.err;
  EXPECT_EQ(test::read_csv(out).size(), 4u);  // header, three trials
  const test::CommandResult all = search("20");
  ASSERT_EQ(all.exit_code, 0) << all.err;
  EXPECT_EQ(test::read_csv(out).size(), 10u);  // nine settings are there
  EXPECT_NE(all.out.find("best: slope_slide mu=0.2, score 0, 0.5 s per s: a 2; b 2"), std::string::npos)
      << all.out;
  EXPECT_EQ(search("20").exit_code, 0);
  EXPECT_EQ(test::read_csv(out).size(), 10u);

  const test::CommandResult run = call("run.py", {"--only", "slope_slide", "--out", rows, "--found", out});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto reported = test::read_csv(rows);
  ASSERT_EQ(reported.size(), 4u);  // header; mu 0.2 plain and found; mu 0.5, for which nothing was searched
  EXPECT_EQ(reported[1][10], "fail");
  EXPECT_EQ(reported[2][2], "found by search");
  EXPECT_EQ(reported[2][10], "pass");
  EXPECT_EQ(reported[2].back(), "a 2; b 2");
}

// How far it is comes from the rows alone, so that a run that goes on counts what was done before.
TEST(FrictionBenchmark, Progress_CountsRowsAndNamesTheRowInWork) {
  const std::string folder = test::scratch("friction_benchmark_progress");
  std::filesystem::create_directories(folder + "/rows");
  test::write_file(folder + "/rows/scenes_sled.csv",
                   "engine,version,configuration,case,parameters,quantity,measured,expected,low,high,verdict,"
                   "cost,note\nsled,1,good,beam,cells=400,sag,1,1,1,1,pass,1,\n");
  const test::CommandResult r =
      test::run({DEFORM_TEST_PYTHON, "-B", "-c",
                 "import sys; sys.path.insert(0, sys.argv[1]); import progress\n"
                 "run = lambda c: progress.Run('scenes', 'sled', c, {'name': 'beam'}, 'cells=400', 40)\n"
                 "p = progress.Progress({'sled': [run('good'), run('bad')]}, sys.argv[2], 1)\n"
                 "print(p.line(()))\nprint(p.line(('sled',)))",
                 std::string(DEFORM_SOURCE_DIR) + "/tests/bench/peers", folder});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  EXPECT_EQ(r.out,
            "1 of 2 runs, about 1 min left\n1 of 2 runs, about 1 min left; sled: beam cells=400, bad\n");
}

// From a folder that has no build/ of its own.
TEST(FrictionBenchmark, MissingCommand_IsReportedInOneSentence) {
  const test::CommandResult r =
      test::run({"/usr/bin/env", "-C", test::scratch("friction_benchmark_elsewhere"), DEFORM_TEST_PYTHON,
                 script("run.py"), "deform", "--command", "no/such/deform", "--only", "slope_slide"});
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_NE(r.err.find("no/such/deform: no such command; build it with `make demo`"), std::string::npos)
      << r.err;
  EXPECT_EQ(r.err.find("Traceback"), std::string::npos) << r.err;
}

TEST(FrictionBenchmark, CalledFromAnotherFolder_FindsTheCommandOfItsCheckout) {
  const std::string folder = test::scratch("friction_benchmark_elsewhere");
  const test::CommandResult r =
      test::run({"/usr/bin/env", "-C", folder, DEFORM_TEST_PYTHON, script("run.py"), "--help"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  const test::CommandResult unknown =
      test::run({"/usr/bin/env", "-C", folder, DEFORM_TEST_PYTHON, script("run.py"), "nobody"});
  EXPECT_NE(unknown.err.find("there is no entry_nobody.py"), std::string::npos) << unknown.err;
}

// Speed at equal error: the cheapest that passes in all its quantities, per engine; the page keeps what
// stands around the marks.
TEST(FrictionBenchmark, SpeedAtEqualError_IsOfTheCheapestThatPasses) {
  const std::string folder = test::scratch("friction_benchmark_speed");
  std::string rows =
      "engine,version,configuration,case,parameters,quantity,measured,expected,low,high,verdict,cost,note\n";
  for (const char *row :
       {"one,1,quick,lift,,force,2,1,0.9,1.1,fail,0.5,", "one,1,good,lift,,force,1,1,0.9,1.1,pass,3,",
        "one,1,better,lift,,force,1,1,0.9,1.1,pass,2,", "one,1,better,lift,,creep,5,0,0,1,fail,2,",
        "one,1,good,lift,,creep,0.5,0,0,1,pass,3,", "two,1,only,lift,,,,,,,error,,fell apart",
        "three,1,none,lift,,,,,,,not_run,,no law with lift"})
    rows += std::string(row) + "\n";
  test::write_file(folder + "/rows.csv", rows);
  test::write_file(folder + "/page", "before\n<!-- table -->\nold\n<!-- end of table -->\nafter\n");
  const std::string speed = script("../peers/speed.py");
  const test::CommandResult r =
      test::run({DEFORM_TEST_PYTHON, speed, folder + "/rows.csv", "--page", folder + "/page"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  EXPECT_EQ(test::read_file(folder + "/page"),
            "before\n<!-- table -->\n\n| case | one | two |\n|---|---|---|\n"
            "| lift  | **3 (good)** | not at any setting run |\n\n<!-- end of table -->\nafter\n");
}

TEST(FrictionBenchmark, BenchPeersWithoutBullet_ReportsOneSentence) {
  const test::CommandResult r =
      test::run({"/usr/bin/env", "PATH=/nowhere", DEFORM_TEST_PYTHON, script("../peers/bench_peers.py"),
                 DEFORM_COMMAND, test::scratch("bench_peers")});
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_EQ(r.err, "bench-peers: pkg-config does not find Bullet; install pkg-config and libbullet-dev\n");
}
