#include "friction_plot.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "friction_plot_script.h"
#include "messages.h"

namespace cli {
namespace {

enum class Drawn { yes, no, cannot };  // cannot: no such interpreter, or it has no matplotlib

// isolated: PYTHONHOME and PYTHONPATH may be settings for another interpreter.
Drawn draw_with(const std::string &python, bool isolated, const std::vector<std::string> &arguments) {
  std::vector<std::string> words = {python};
  if (isolated) words.push_back("-E");
  words.insert(words.end(), {"-c", kPlotFriction});
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char *> argv;
  for (std::string &word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t child = 0;
  if (posix_spawnp(&child, python.c_str(), nullptr, nullptr, argv.data(), environ) != 0) return Drawn::cannot;
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
  const char *const named = std::getenv("DEFORM_PYTHON");
  Drawn drawn = draw_with(named ? named : DEFORM_PYTHON, !named, arguments);
  if (drawn == Drawn::cannot && !named) drawn = draw_with("python3", false, arguments);
  if (drawn == Drawn::yes) return true;
  std::remove((picture + ".part").c_str());
  if (drawn == Drawn::cannot) return false;
  throw Failure(kBadInput, picture + ": matplotlib could not write the plot; its message is above");
}

}  // namespace cli
