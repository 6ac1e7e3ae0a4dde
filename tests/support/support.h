// What several test programs share: where things lie, running the command, reference data.
#pragma once
#include <sys/types.h>

#include <string>
#include <vector>

namespace test {

// Starts a program (no shell) that has nothing to read; what it writes goes into the two files. Its end is
// for the caller to wait for.
pid_t start(const std::vector<std::string> &argv, const std::string &out = "/dev/null",
            const std::string &err = "/dev/null");

struct CommandResult {
  int exit_code;
  std::string out, err;
};
// Runs a program (no shell) with its own HOME and waits for it; exit_code is 128+signal where a
// signal ended it.
CommandResult run(const std::vector<std::string> &argv);
// The `deform` command of this build.
CommandResult deform(std::vector<std::string> args);
// Exit code 2, and one line of print that begins with the program's name and holds all of the parts.
void expect_refused(const CommandResult &result, const std::vector<std::string> &parts,
                    const std::string &what = "");
inline void expect_refused(const std::vector<std::string> &args, const std::vector<std::string> &parts) {
  expect_refused(deform(args), parts);
}

// The reference set and the meshes of the tests, which CMake unpacks from tests/data.
std::string reference_dir();
std::string mesh_dir();
// A fresh folder below the build tree for one test's files.
std::string scratch(const std::string &name);
std::string read_file(const std::string &path);
void write_file(const std::string &path, const std::string &text);
std::vector<std::vector<std::string>> read_csv(const std::string &path);

}  // namespace test
