#include "plot.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <vector>

#include "become.h"
#include "plot_script.h"
#include "messages.h"

namespace cli {
namespace {

enum class Drawn { yes, no, cannot };  // cannot: no such interpreter, or it has no matplotlib

// isolated, of the build's own interpreter: PYTHONHOME and PYTHONPATH may be settings for another one. said:
// out, what the script prints: why the picture cannot be written.
Drawn draw_with(const std::string &python, bool isolated, const std::vector<std::string> &arguments,
                std::string &said) {
  std::vector<std::string> words = {python};
  if (isolated) words.push_back("-E");
  words.insert(words.end(), {"-c", kPlotFriction});
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char *> argv;
  for (std::string &word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw Failure(kBadInput, std::string("no pipe: ") + std::strerror(errno));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  pid_t child = 0;
  const bool begun = posix_spawnp(&child, python.c_str(), &actions, nullptr, argv.data(), environ) == 0;
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  char part[256];
  for (ssize_t n = 1; begun && n != 0;) {
    n = read(ends[0], part, sizeof part);
    if (n < 0 && errno != EINTR) break;
    if (n > 0) said.append(part, size_t(n));
  }
  close(ends[0]);
  if (!begun) return Drawn::cannot;
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) return Drawn::no;
  if (!WIFEXITED(status)) return Drawn::no;
  const int code = WEXITSTATUS(status);
  return code == 0 ? Drawn::yes : code == 3 || code == 126 || code == 127 ? Drawn::cannot : Drawn::no;
}

}  // namespace

bool plot_friction(const std::string &csv, const std::string &picture, const std::string &kind,
                   const std::string &title) {
  const std::vector<std::string> arguments = {csv, picture, kind, title};
  std::string said;
  Drawn drawn = Drawn::cannot;
  const std::vector<std::string> interpreters = pythons();
  for (size_t i = 0; i < interpreters.size() && drawn == Drawn::cannot; i++)
    drawn = draw_with(interpreters[i], i + 1 < interpreters.size(), arguments, said);
  if (drawn == Drawn::yes) return true;
  std::remove((picture + ".part").c_str());
  if (drawn == Drawn::cannot) return false;
  if (const std::string why = said.substr(0, said.find('\n')); !why.empty())
    throw Failure(kBadInput, picture + ": cannot be written: " + why);
  throw Failure(kBadInput, picture + ": matplotlib could not write the plot; its message is above");
}

}  // namespace cli
