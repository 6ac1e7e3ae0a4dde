#include "support.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

namespace test {

pid_t start(const std::vector<std::string> &argv, const std::string &out, const std::string &err) {
  const pid_t child = fork();
  if (child != 0) return child;
  std::vector<char *> args;
  for (const auto &a : argv) args.push_back(const_cast<char *>(a.c_str()));
  args.push_back(nullptr);
  const int fo = open(out.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0644);
  const int fe = open(err.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0644);
  const int in = open("/dev/null", O_RDONLY);
  dup2(in, 0);
  dup2(fo, 1);
  dup2(fe, 2);
  execvp(args[0], args.data());
  _exit(127);
}

CommandResult run(const std::vector<std::string> &argv) {
  static int counter = 0;
  const std::string base = scratch("run") + "/" + std::to_string(getpid()) + "_" + std::to_string(counter++);
  const std::string out = base + ".out", err = base + ".err";
  const pid_t child = start(argv, out, err);
  int status = 0;
  waitpid(child, &status, 0);
  CommandResult result;
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.out = read_file(out);
  result.err = read_file(err);
  unlink(out.c_str());
  unlink(err.c_str());
  return result;
}

CommandResult deform(std::vector<std::string> args) {
  const auto has = [&](const char *word) { return std::find(args.begin(), args.end(), word) != args.end(); };
  const bool pictures = !std::getenv("DEFORM_RENDER_BACKEND");
  const bool draws =
      has("--frames") || (has("replay") && (has("--out") || has("--states"))) || (has("cost") && pictures);
  args.insert(args.begin(), DEFORM_COMMAND);
  if (draws) {  // LeakSanitizer's own tracer crashes while a thread of the software driver ends
    const char *const given = std::getenv("ASAN_OPTIONS");
    args.insert(args.begin(),
                {"env", std::string("ASAN_OPTIONS=") + (given ? given : "") + ":detect_leaks=0"});
  }
  return run(args);
}

void expect_refused(const CommandResult &result, const std::vector<std::string> &parts,
                    const std::string &what) {
  SCOPED_TRACE(what + "\n" + result.err);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.err.rfind("deform: ", 0), 0u);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << "one sentence";
  EXPECT_TRUE(std::all_of(result.err.begin(), result.err.end(),
                          [](char c) { return c == '\n' || static_cast<unsigned char>(c) >= 0x20; }));
  for (const std::string &part : parts)
    EXPECT_NE(result.err.find(part), std::string::npos) << "expected " << part;
}

std::string reference_dir() { return DEFORM_BINARY_DIR "/test-data/reference"; }
std::string mesh_dir() { return DEFORM_BINARY_DIR "/test-data/meshes"; }

// Tests are processes that run side by side, so each has a folder of its own.
std::string scratch(const std::string &name) {
  const testing::TestInfo *const test = testing::UnitTest::GetInstance()->current_test_info();
  std::string own = test ? std::string(test->test_suite_name()) + "." + test->name() : "no test";
  std::replace(own.begin(), own.end(), '/', '_');
  const std::string dir = std::string(DEFORM_BINARY_DIR) + "/test-scratch/" + own + "/" + name;
  std::filesystem::create_directories(dir);
  return dir;
}

std::string read_file(const std::string &path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

void write_file(const std::string &path, const std::string &text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::vector<std::vector<std::string>> read_csv(const std::string &path) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream in(read_file(path));
  for (std::string line; std::getline(in, line);) {
    std::vector<std::string> row;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    rows.push_back(row);
  }
  return rows;
}

}  // namespace test
