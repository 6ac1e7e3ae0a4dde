#include "become.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "cli.h"
#include "messages.h"

namespace fs = std::filesystem;

namespace cli {

void become(const std::string &subcommand, const std::string &name, const std::vector<std::string> &words,
            const std::string &missing) {
  std::error_code unused;
  const std::string program = fs::read_symlink("/proc/self/exe", unused).parent_path() / name;
  if (access(program.c_str(), X_OK) != 0)
    throw Failure(kBadInput, subcommand + ": there is no " + program + "; " + missing);
  std::vector<const char *> argv{program.c_str()};
  for (const std::string &word : words) argv.push_back(word.c_str());
  argv.push_back(nullptr);
  execv(program.c_str(), const_cast<char **>(argv.data()));
  throw Failure(kBadInput, subcommand + ": " + program + " cannot be started: " + std::strerror(errno));
}

}  // namespace cli
