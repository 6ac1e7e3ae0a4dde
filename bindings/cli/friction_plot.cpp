#include "friction_plot.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

#include "friction_plot_script.h"
#include "messages.h"

namespace cli {

bool plot_friction(const std::string &csv, const std::string &picture, const std::string &kind, const std::string &title) {
  const std::string words[] = {"python3", "-c", kPlotFriction, csv, picture, kind, title};
  char *argv[8] = {};
  for (int i = 0; i < 7; ++i) argv[i] = const_cast<char *>(words[i].c_str());
  pid_t child = 0;
  if (posix_spawnp(&child, "python3", nullptr, nullptr, argv, environ) != 0) return false;
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) return false;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return true;
  std::remove((picture + ".part").c_str());
  if (WIFEXITED(status) && (WEXITSTATUS(status) == 3 || WEXITSTATUS(status) == 127)) return false;
  throw Failure(kBadInput, picture + ": matplotlib could not write the plot; its message is above");
}

}  // namespace cli
