#include "become.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "arguments.h"
#include "cli.h"
#include "messages.h"

namespace fs = std::filesystem;

namespace cli {
std::string beside(const std::string &name) {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  if (error)
    throw Failure(kBadInput, "/proc/self/exe cannot be read: the command does not know where it lies");
  return self.parent_path() / name;
}

std::vector<std::string> pythons() {
  if (const char *const named = std::getenv("DEFORM_PYTHON")) return {named};
  return {DEFORM_PYTHON, "python3"};
}

void become(const std::string &subcommand, const std::string &name, const std::vector<std::string> &words,
            const std::string &missing) {
  const std::string program = beside(name);
  if (access(program.c_str(), X_OK) != 0)
    throw Failure(kBadInput, subcommand + ": there is no " + program + "; " + missing);
  std::vector<const char *> argv{program.c_str()};
  for (const std::string &word : words) argv.push_back(word.c_str());
  argv.push_back(nullptr);
  execv(program.c_str(), const_cast<char **>(argv.data()));
  throw Failure(kBadInput, subcommand + ": " + program + " cannot be started: " + std::strerror(errno));
}

void add_program(Command parent, const Globals &globals, const Program &program) {
  parent.command(program.name, program.about).calls_at_once([&globals, program] {
    become(program.name, program.file, globals.words, program.missing);
  });
}

}  // namespace cli
