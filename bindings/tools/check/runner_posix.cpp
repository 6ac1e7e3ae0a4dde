#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "check/process.h"
#include "leaving.h"
#include "messages.h"

namespace cli::check {
namespace {

// Is the process waiting (not for the processor or a disk)?
bool waits(pid_t child) {
  char path[64], line[512];
  std::snprintf(path, sizeof path, "/proc/%d/stat", static_cast<int>(child));
  const int fd = open(path, O_RDONLY | O_CLOEXEC);
  const ssize_t n = fd < 0 ? -1 : read(fd, line, sizeof line - 1);
  if (fd >= 0) close(fd);
  if (n <= 0) return false;
  line[n] = 0;
  // the name of the program comes before it and may contain anything
  const char *after = std::strrchr(line, ')');
  return after && after[1] == ' ' && after[2] == 'S';
}

double clock_of(clockid_t clock) {
  timespec t{};
  if (clock_gettime(clock, &t) != 0) return -1;
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

const char *signal_name(int number) {
  switch (number) {
    case SIGSEGV: return "SIGSEGV (it accessed memory that does not belong to it)";
    case SIGBUS: return "SIGBUS (it accessed memory that does not exist)";
    case SIGABRT: return "SIGABRT (it called abort, or threw through a C function)";
    case SIGFPE: return "SIGFPE (a whole number was divided by zero)";
    case SIGILL: return "SIGILL (an instruction that this processor lacks)";
    default: return nullptr;
  }
}

std::string ending_of(int status) {
  if (WIFEXITED(status)) return text("left its process by itself with exit code %d", WEXITSTATUS(status));
  const char *name = signal_name(WTERMSIG(status));
  return name ? text("ended its process by %s", name)
              : text("ended its process by signal %d", WTERMSIG(status));
}

[[noreturn]] void become_child(const std::function<void()> &work, int to_report, int to_output) {
  setpgid(0, 0);
  leave(0);  // how it ends is for the parent to judge
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const int input = open("/dev/null", O_RDONLY);
  dup2(input, 0);
  dup2(to_output, 1);
  dup2(to_output, 2);
  report_to(to_report);
  try {
    work();
  } catch (...) {
    // never back into what the parent would do next
    _exit(1);
  }
  std::fflush(nullptr);
  _exit(0);
}

void open_pipe(int ends[2]) {
  if (pipe2(ends, O_CLOEXEC) != 0) throw Failure(kBadInput, kNoPipe);
}

// What the child wrote before it ended; a process that it left behind is not waited for.
template <class Take>
void read_rest(int fd, Take take) {
  char buffer[4096];
  fcntl(fd, F_SETFL, O_NONBLOCK);
  for (ssize_t n; (n = read(fd, buffer, sizeof buffer)) > 0;) take(buffer, n);
  close(fd);
}

Outcome in_fork(const std::function<void()> &work, const Limits &limits) {
  int report[2], output[2];
  open_pipe(report);
  open_pipe(output);
  // or the child would print what waits here once more
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) become_child(work, report[1], output[1]);
  close(report[1]);
  close(output[1]);
  if (child < 0) throw Failure(kBadInput, kNoProcess);
  Outcome out;
  ChildOutput heard(out);
  pollfd ends[2] = {{report[0], POLLIN, 0}, {output[0], POLLIN, 0}};
  clockid_t clock;
  const bool timed = clock_getcpuclockid(child, &clock) == 0;
  TimeLimit limit(limits, out);
  char buffer[4096];
  int status = 0;
  for (bool ended = false; !ended;) {
    poll(ends, 2, ends[0].fd < 0 && ends[1].fd < 0 ? 1 : 5);  // both closed: it ends any moment
    for (int k = 0; k < 2; ++k) {
      if (!(ends[k].revents & (POLLIN | POLLHUP | POLLERR))) continue;
      const ssize_t n = read(ends[k].fd, buffer, sizeof buffer);
      if (n <= 0) ends[k].fd = -1;  // at its end: poll passes over negative descriptors
      else if (k == 0) heard.take_report(buffer, size_t(n));
      else heard.take_output(buffer, size_t(n));
    }
    const double used = timed ? std::max(clock_of(clock), out.seconds) : 0;
    if (!out.late && limit.ends(used, [&] { return waits(child); })) {
      kill(-child, SIGKILL);
      kill(child, SIGKILL);
    }
    ended = waitpid(child, &status, WNOHANG) == child;
  }
  read_rest(report[0], [&](const char *bytes, ssize_t n) { heard.take_report(bytes, size_t(n)); });
  read_rest(output[0], [&](const char *bytes, ssize_t n) { heard.take_output(bytes, size_t(n)); });
  kill(-child, SIGKILL);
  if (!out.spoke) out.ending = out.late ? limit.ending() : ending_of(status);
  return out;
}

}  // namespace

void keep_from_children(int descriptor) { fcntl(descriptor, F_SETFD, FD_CLOEXEC); }

void suppress_crash_dialogs() {}

Outcome in_own_process(const std::function<void()> &work, const std::string &,
                       const std::vector<std::string> &, const Limits &limits) {
  return in_fork(work, limits);
}

Outcome in_fresh_process(const std::string &command, std::vector<std::string> arguments,
                         const Limits &limits) {
  const auto become = [&] {
    fcntl(reports(), F_SETFD, 0);
    arguments.push_back("--report-to");
    arguments.push_back(std::to_string(reports()));
    std::vector<char *> argv{const_cast<char *>("deform")};
    for (std::string &a : arguments) argv.push_back(a.data());
    argv.push_back(nullptr);
    // a cache of free pieces would look like a leak to V09
    setenv("GLIBC_TUNABLES", "glibc.malloc.tcache_count=0", 1);
    execv(command.c_str(), argv.data());
    _exit(127);
  };
  return in_fork(become, limits);
}

}  // namespace cli::check
