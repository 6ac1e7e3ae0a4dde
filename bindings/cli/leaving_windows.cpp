#include <windows.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>

#include "deform/deform.h"
#include "leaving.h"

namespace cli {
namespace {

std::atomic<bool> undecided{false};
std::string folder;

void say(const char *end) {
  const char *what = nullptr, *const who = dfm_plugin_running(&what);
  if (who) std::fprintf(stderr, "deform: plugin '%s' (%s) ", who, what ? what : "?");
  else std::fprintf(stderr, "deform: something other than the command ");
  std::fprintf(stderr, "%s%s%s\n", end, folder.empty() ? "" : "; what was recorded until then is in ",
               folder.c_str());
}

void at_exit_handler() {
  if (!undecided.exchange(false)) return;
  say("ended the process before its work was done; a plugin must return a status instead");
  std::_Exit(kEndedByPlugin);
}

LONG WINAPI on_crash(EXCEPTION_POINTERS *) {
  if (undecided.exchange(false))
    say("ended the process (it accessed memory that is not its own, or the like)");
  return EXCEPTION_CONTINUE_SEARCH;
}

}  // namespace

void guard_leaving() {
  undecided = true;
  std::atexit(at_exit_handler);
  SetUnhandledExceptionFilter(on_crash);
}

int leave(int exit_code) {
  undecided = false;
  return exit_code;
}

void results_lie_in(const std::string &where) { folder = where; }

// A second signal ends the process (system.h).
void expect_return() {}
void came_back() {}

}  // namespace cli
