// The command with one operator new refused, at places spread over its whole life: it ends by itself, with a
// documented exit code and a sentence.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "support.h"

namespace {

test::CommandResult deform_without(long n, const std::string &count, const std::vector<std::string> &args) {
  // By its name in a folder: LD_PRELOAD is split at spaces, which a path may hold.
  const std::filesystem::path preload = DEFORM_REFUSE_NEW;
  std::vector<std::string> argv{"/usr/bin/env", "LD_LIBRARY_PATH=" + preload.parent_path().string(),
                                "LD_PRELOAD=" + preload.filename().string(),
                                "REFUSE_NEW=" + std::to_string(n)};
  argv.insert(argv.end(), {"REFUSE_NEW_COUNT=" + count, DEFORM_COMMAND});
  argv.insert(argv.end(), args.begin(), args.end());
  return test::run(argv);
}

// Every allocation in turn would be thousands of runs: the first ones of the set-up each by itself, the
// others in strides that grow, and the last ones. runs 0: every allocation.
void walk(const std::string &name, const std::vector<std::string> &args, int runs) {
#ifdef DEFORM_SANITIZED
  GTEST_SKIP() << "a sanitizer brings its own operator new";
#endif
  const std::string folder = test::scratch("refused_" + name), count = folder + "/count";
  std::vector<std::string> with = args;
  if (args[0] == "run") with.insert(with.end(), {"--out", folder + "/out"});
  const test::CommandResult whole = deform_without(-1, count, with);
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  const long total = std::atol(test::read_file(count).c_str());
  ASSERT_GT(total, 100);
  long refused = 0;
  const long last = runs ? runs : total;
  for (long i = 0; i < last; ++i) {
    const long n = runs ? long(std::llround(std::pow(double(total), double(i) / (runs - 1)))) - 1 : i;
    // What an earlier run has left is looked through and removed.
    if (args[0] == "run")
      for (const char *left :
           {"summary.json.part1", "bodies.csv.part2", "states/b_000001.vtu", "states/last_b.vtu"})
        test::write_file(folder + "/out/" + left, "x");
    const test::CommandResult r = deform_without(n, count, with);
    EXPECT_TRUE(r.exit_code == 0 || r.exit_code == 2 || r.exit_code == 3)
        << name << ", allocation " << n << " of " << total << ": exit " << r.exit_code << "\n"
        << r.err;
    refused += r.exit_code != 0;
    if (r.exit_code != 0) {
      EXPECT_NE(r.err.find("deform: "), std::string::npos)
          << "allocation " << n << " of " << total << ": " << r.err;
    }
  }
  EXPECT_GT(refused, last / 2);
}

}  // namespace

// unsanitized: the sanitizer's own operator new must come first
TEST(RefusedCommand, RunOfAScene_EndsWithASentence) {
  walk("run", {"run", DEFORM_SOURCE_DIR "/examples/scenes/slope_block.json", "--time", "0.002", "--quiet"},
       500);
}
// soak: 19,000 runs, of which those above are a choice
TEST(RefusedCommand, RunOfAScene_EveryAllocation_EndsWithASentence) {
  walk("run_all",
       {"run", DEFORM_SOURCE_DIR "/examples/scenes/slope_block.json", "--time", "0.002", "--quiet"}, 0);
}
// unsanitized: the sanitizer's own operator new must come first
TEST(RefusedCommand, RunOfRigidBodies_EndsWithASentence) {
  walk("rigid", {"run", DEFORM_SOURCE_DIR "/examples/scenes/rigid_on_bed.json", "--time", "0.002", "--quiet"},
       200);
}
// unsanitized: the sanitizer's own operator new must come first
TEST(RefusedCommand, Explain_EndsWithASentence) {
  walk("explain", {"explain", DEFORM_SOURCE_DIR "/examples/scenes/two_cylinders_coarse.json"}, 200);
}
// unsanitized: the sanitizer's own operator new must come first
TEST(RefusedCommand, PluginList_EndsWithASentence) { walk("list", {"plugin", "list"}, 150); }
