#include "leaving.h"

#ifdef __EMSCRIPTEN__  // no plugin comes from a file, and there are no signals

namespace cli {

void guard_leaving() {}
int leave(int exit_code) { return exit_code; }
void results_lie_in(const std::string &) {}
void expect_return() {}
void came_back() {}

}  // namespace cli

#else

#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "deform/deform.h"
#include "messages.h"

#if !defined(__linux__) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define DEFORM_OWN_EXIT 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define DEFORM_OWN_EXIT 0
#endif
#endif
#ifndef DEFORM_OWN_EXIT
#define DEFORM_OWN_EXIT 1
#endif

namespace cli {
namespace {

constexpr unsigned kGraceInPlugin = 5, kGrace = 30;  // s
volatile std::sig_atomic_t undecided = 0;
volatile std::sig_atomic_t waited = 0;  // s since expect_return()
char folder[1024];
int terminal = 0;  // standard error is one: it may hold a line of progress

// Everything below may run in a handler of a signal: no memory, no locks, write() alone.
class Sentence {
 public:
  Sentence &operator<<(const char *part) {
    const size_t n = std::min(std::strlen(part), sizeof text_ - 2 - used_);
    std::memcpy(text_ + used_, part, n);
    used_ += n;
    return *this;
  }
  void say() {
    text_[used_++] = '\n';
    if (write(STDERR_FILENO, text_, used_) < 0) return;
  }

 private:
  char text_[2048];
  size_t used_ = 0;
};

// Returns whether a plugin is at work in this thread.
bool begin(Sentence &s) {
  const char *what = nullptr, *who = dfm_plugin_running(&what);
  s << "deform: ";
  if (who) s << "plugin '" << who << "' (" << (what ? what : "?") << ") ";
  else s << "something other than the command ";
  return who != nullptr;
}

void end(Sentence &s) {
  if (*folder) s << "; what was recorded until then is in " << folder;
  s.say();
}

[[noreturn]] void end_now(int code) {
#if DEFORM_OWN_EXIT
  for (;;) syscall(SYS_exit_group, code);
#else
  _exit(code);
#endif
}

// Handles exit, quick_exit and _exit, whatever code they were given.
void at_exit_handler() {
  if (!undecided) return;
  undecided = 0;
  Sentence s;
  begin(s);
  s << "ended the process before its work was done; a plugin must return a status instead";
  end(s);
  end_now(kEndedByPlugin);
}

const char *name_of(int number) {
  return number == SIGSEGV  ? "SIGSEGV: it accessed memory that does not belong to it"
         : number == SIGBUS ? "SIGBUS: it accessed memory that does not exist"
         : number == SIGFPE ? "SIGFPE: a division by zero, or a floating-point exception that was unmasked"
         : number == SIGILL ? "SIGILL: an instruction that this processor lacks"
                            : "SIGABRT: abort, or a failed assertion";
}

// With SA_RESETHAND the signal then ends the process as usual.
void on_crash(int number) {
  if (undecided) {
    Sentence s;
    begin(s);
    s << "ended the process (" << name_of(number) << ")";
    end(s);
  }
  raise(number);
}

void on_alarm(int) {
  waited = waited + 1;
  Sentence s;
  const bool in_plugin = begin(s);
  if (!(in_plugin && waited >= static_cast<int>(kGraceInPlugin)) && waited < static_cast<int>(kGrace)) {
    alarm(1);
    return;
  }
  s << "has not come back since the signal that asked for an end: the process is ended";
  end(s);
  end_now(kInterrupted);
}

// The command's own work took the signal over where it has something to keep.
void on_interrupt(int number) {
  if (undecided) {
    Sentence s;
    s << (terminal ? "\r\033[K" : "")
      << "deform: interrupted before its work was done; no unfinished file is left";
    s.say();
  }
  raise(number);
}

void catch_interrupts() {
  terminal = isatty(STDERR_FILENO);
  for (const int number : {SIGINT, SIGTERM}) {
    struct sigaction before = {}, action = {};
    sigaction(number, nullptr, &before);
    if (before.sa_handler != SIG_DFL) continue;  // whoever started the command ignores it
    action.sa_handler = on_interrupt;
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_NODEFER);
    sigaction(number, &action, nullptr);
  }
}

void catch_crashes() {
  static char room[65536];  // a stack that is full has none left for its handler
  stack_t stack = {};
  stack.ss_sp = room;
  stack.ss_size = sizeof room;
  sigaltstack(&stack, nullptr);
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) {
    struct sigaction before = {}, action = {};
    sigaction(number, nullptr, &before);
    if (before.sa_handler != SIG_DFL) continue;  // a sanitizer's
    action.sa_handler = on_crash;
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_ONSTACK | SA_NODEFER);
    sigaction(number, &action, nullptr);
  }
}

}  // namespace

void guard_leaving() {
  undecided = 1;
  std::atexit(at_exit_handler);
  std::at_quick_exit(at_exit_handler);
  catch_crashes();
  catch_interrupts();
  std::signal(SIGXFSZ, SIG_IGN);  // a file beyond the limit: what writes it says so
}

int leave(int exit_code) {
  undecided = 0;
  return exit_code;
}

void results_lie_in(const std::string &where) { std::strncpy(folder, where.c_str(), sizeof folder - 1); }

void expect_return() {
  struct sigaction action = {};
  action.sa_handler = on_alarm;
  sigaction(SIGALRM, &action, nullptr);
  waited = 0;
  alarm(1);
}

void came_back() { alarm(0); }

}  // namespace cli

// The dynamic linker binds the calls of every library to the program's own function first, so these see a
// plugin's _exit, too; a system call in its own machine code they do not.
#if DEFORM_OWN_EXIT
extern "C" [[gnu::visibility("default")]] void _exit(int code) {  // noreturn by its declaration
  cli::at_exit_handler();
  cli::end_now(code);
}
extern "C" [[gnu::visibility("default")]] void _Exit(int code) noexcept { _exit(code); }
#endif

#endif
