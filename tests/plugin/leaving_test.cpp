// A plugin that ends the process, or never comes back, does not make a run look done: the exit code is not 0,
// a sentence names it, and what was recorded stays.
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <thread>

#include "tiny_support.h"
#include "world.h"

#ifdef DEFORM_SANITIZED
#define SANITIZED 1
#else
#define SANITIZED 0
#endif

namespace {

constexpr int kEndedByPlugin = 4, kInterrupted = 130;

// A block on a floor; the law is asked some hundred times in each recorded interval.
std::string scene_with(int way) {
  return R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.2, "step": 0.0005},
  "materials": {"gel": {"density": 1000, "young": 50000, "poisson": 0.3,
    "damping": {"mass": 2, "stiffness": 0.002}}},
  "bodies": [{"name": "block", "mesh": "block.msh", "material": "gel", "pose": {"position": [0, 0, 0.0005]},
    "velocity": [0.1, 0, 0]}],
  "obstacles": [{"name": "floor", "shape": "plane"}],
  "contact": {"friction": [{"between": ["*", "*"], "law": "leaves", "params": {"way": )" +
         std::to_string(way) + R"(}}]},
  "output": {"every": 0.01}})";
}

struct Leaving : testing::Test {
  std::string dir = tiny::folder("leaving"), out = dir + "/out";
  void SetUp() override {
    test::Context context;
    dfm_mesh_handle mesh = 0;
    const double size[3] = {0.1, 0.1, 0.1};
    test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 60, &mesh));
    test::ok(dfm_mesh_write(mesh, (dir + "/block.msh").c_str()));
    std::filesystem::create_directories(dir + "/plugins");
    std::filesystem::copy_file(tiny::plugin("tiny_leaves"), dir + "/plugins/leaves.so");
    setenv("DEFORM_PLUGIN_PATH", (dir + "/plugins").c_str(), 1);
  }
  void TearDown() override { unsetenv("DEFORM_PLUGIN_PATH"); }
  test::CommandResult run(int way) {
    test::write_file(dir + "/scene.json", scene_with(way));
    return test::deform({"run", dir + "/scene.json", "--out", out});
  }
  size_t recorded() const { return test::read_csv(out + "/bodies.csv").size(); }
};

TEST_F(Leaving, LawThatReturns_EndsWithZero) {
  EXPECT_EQ(run(0).exit_code, 0);
  EXPECT_GT(recorded(), 20u);
}

TEST_F(Leaving, LawThatExits_EndsNeitherWithZeroNorWithoutAWord) {
  for (int way = 1; way <= 3; ++way) {
    if (SANITIZED && way == 2) continue;  // the sanitizer's own _exit is called
    const test::CommandResult r = run(way);
    EXPECT_EQ(r.exit_code, kEndedByPlugin) << way << r.err;
    EXPECT_NE(r.err.find("plugin 'org.tiny.leaves' (eval) ended the process before its work was done"),
              std::string::npos)
        << way << r.err;
    EXPECT_NE(r.err.find(out), std::string::npos) << r.err;
    EXPECT_GT(recorded(), 1u) << way;
    EXPECT_EQ(r.out.find("written"), std::string::npos);
  }
}

TEST_F(Leaving, LawThatCrashes_IsNamed) {
  if (SANITIZED) return;  // its report is the sanitizer's
  for (const int way : {4, 5, 6}) {
    const test::CommandResult r = run(way);
    EXPECT_NE(r.exit_code, 0) << way << r.err;
    EXPECT_NE(r.err.find("plugin 'org.tiny.leaves' (eval) ended the process (SIG"), std::string::npos)
        << way << r.err;
    EXPECT_GT(recorded(), 1u) << way;
  }
}

TEST_F(Leaving, FileThatExitsWhenItIsLoaded_IsNamed) {
  std::filesystem::copy_file(tiny::plugin("tiny_exits_at_load"), dir + "/plugins/exits.so");
  const std::vector<std::string> list{"plugin", "list"};
  const std::vector<std::string> make{"mesh", "make",    "beam", "--size", "1",           "1",
                                      "1",    "--cells", "5",    "--out",  dir + "/m.msh"};
  for (const auto &args : {list, make}) {
    const test::CommandResult r = test::deform(args);
    EXPECT_EQ(r.exit_code, kEndedByPlugin) << r.out << r.err;
    EXPECT_NE(r.err.find("exits.so' (load) ended the process"), std::string::npos) << r.err;
  }
}

// A signal that asks for an end is waited for while the law does not come back, and then the process ends by
// itself; a second signal ends it at once.
// unsanitized: its rules have limits of time; other tests run them
TEST_F(Leaving, LawThatHangs_EndsSomeTimeAfterASignalAndAtOnceAfterASecond) {
  for (const bool twice : {false, true}) {
    test::write_file(dir + "/scene.json", scene_with(twice ? 8 : 7));
    const std::string words = dir + "/words.txt";
    const pid_t child =
        test::start({DEFORM_COMMAND, "run", dir + "/scene.json", "--out", out}, "/dev/null", words);
    const auto wait = [](double seconds) {
      std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    };
    for (int k = 0; k < 600 && recorded() < 3; ++k) wait(0.1);
    wait(1);
    kill(child, SIGTERM);
    if (twice) {
      wait(0.5);
      kill(child, SIGTERM);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_GT(recorded(), 1u);
    if (twice) {
      EXPECT_TRUE(WIFSIGNALED(status));
    } else {
      EXPECT_TRUE(WIFEXITED(status));
      EXPECT_EQ(WEXITSTATUS(status), kInterrupted);
      EXPECT_NE(
          test::read_file(words).find("plugin 'org.tiny.leaves' (eval) has not come back since the signal"),
          std::string::npos)
          << test::read_file(words);
    }
  }
}

}  // namespace
