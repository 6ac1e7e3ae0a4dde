#include "trap.h"

#include <ode/ode.h>

#include <cstdarg>
#include <cstdio>
#include <mutex>

namespace dfm_ode_detail {
namespace {

thread_local int inside = 0;  // number of our calls on this thread
std::mutex mutex;             // guards the variables below
int traps = 0;
dMessageFunction *theirs_debug = nullptr, *theirs_error = nullptr;

void caught(int number, const char *message, va_list args, dMessageFunction *theirs) {
  if (inside > 0) {
    char text[256];
    std::vsnprintf(text, sizeof text, message, args);
    throw Assertion{text};
  }
  if (theirs) return theirs(number, message, args);
  // ODE's own message if no handler is set; it ends the process after them
  std::fprintf(stderr, "\nODE INTERNAL ERROR %d: ", number);
  std::vfprintf(stderr, message, args);
  std::fprintf(stderr, "\n");
}
void on_debug(int number, const char *message, va_list args) { caught(number, message, args, theirs_debug); }
void on_error(int number, const char *message, va_list args) { caught(number, message, args, theirs_error); }

}  // namespace

Trap::Trap() {
  const std::lock_guard lock(mutex);
  if (traps++ == 0) {
    theirs_debug = dGetDebugHandler();
    theirs_error = dGetErrorHandler();
    dSetDebugHandler(on_debug);
    dSetErrorHandler(on_error);
  }
  ++inside;
}

Trap::~Trap() {
  const std::lock_guard lock(mutex);
  --inside;
  if (--traps > 0) return;
  if (dGetDebugHandler() == on_debug) dSetDebugHandler(theirs_debug);  // else another one was set
  if (dGetErrorHandler() == on_error) dSetErrorHandler(theirs_error);
}

}  // namespace dfm_ode_detail
