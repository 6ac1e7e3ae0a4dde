#include "become.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "arguments.h"
#include "cli.h"
#include "messages.h"
#include "system.h"

namespace fs = std::filesystem;

namespace cli {
std::string beside(const std::string &name) {
  const std::string self = os::own_file();
  if (self.empty()) throw Failure(kBadInput, "the system does not tell the command where it lies");
  return name_of(path_of(self).parent_path() / path_of(name));
}

std::vector<std::string> pythons() {
  if (const char *const named = std::getenv("DEFORM_PYTHON")) return {named};
  return {DEFORM_PYTHON, "python3"};
}

void become(const std::string &subcommand, const std::string &name, const std::vector<std::string> &words,
            const std::string &missing) {
  const std::string program = beside(name + os::kProgramEnding);
  std::error_code unknown;
  if (!fs::exists(path_of(program), unknown))
    throw Failure(kBadInput, subcommand + ": there is no " + program + "; " + missing);
  os::become(program, words);
  throw Failure(kBadInput, subcommand + ": " + program + " cannot be started: " + std::strerror(errno));
}

void add_program(Command parent, const Globals &globals, const Program &program) {
  parent.command(program.name, program.about).calls_at_once([&globals, program] {
    become(program.name, program.file, globals.words, program.missing);
  });
}

}  // namespace cli
