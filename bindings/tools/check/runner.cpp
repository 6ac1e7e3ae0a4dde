#include "check/runner.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "leaving.h"
#include "messages.h"

namespace cli::check {
namespace {

int report = -1;

std::string formatted(const char *format, va_list args) {
  char buffer[2048];
  std::vsnprintf(buffer, sizeof buffer, format, args);
  return buffer;
}

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

// A message is a letter, text and a zero: 's' stage, 'P' 'F' 'S' verdict.
void send(char letter, const std::string &what) {
  std::string message = letter + what;
  message.push_back('\0');
  for (size_t at = 0; at < message.size();) {
    const ssize_t n = write(report, message.data() + at, message.size() - at);
    if (n < 0 && errno != EINTR) return;
    if (n > 0) at += static_cast<size_t>(n);
  }
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

void read_reports(Outcome &out, std::string &pending) {
  for (size_t end; (end = pending.find('\0')) != std::string::npos; pending.erase(0, end + 1)) {
    const char letter = pending[0];
    const std::string what(pending, 1, end - 1);
    if (letter == 's') {
      out.at = what;
    } else {
      out.spoke = true;
      out.verdict = {letter == 'P' ? Result::pass : letter == 'F' ? Result::fail : Result::skip, what};
    }
  }
}

}  // namespace

std::string text(const char *format, ...) {
  va_list args;
  va_start(args, format);
  std::string out = formatted(format, args);
  va_end(args);
  return out;
}

void broken(const char *format, ...) {
  va_list args;
  va_start(args, format);
  const std::string sentence = formatted(format, args);
  va_end(args);
  throw Broken(sentence);
}

void skip(const char *format, ...) {
  va_list args;
  va_start(args, format);
  const std::string sentence = formatted(format, args);
  va_end(args);
  throw Skipped(sentence);
}

void report_to(int descriptor) {
  report = descriptor;
  if (report >= 0) fcntl(report, F_SETFD, FD_CLOEXEC);
}

void stage(const char *format, ...) {
  if (report < 0) return;
  va_list args;
  va_start(args, format);
  send('s', formatted(format, args));
  va_end(args);
}

void send_verdict(const Verdict &verdict) {
  if (report >= 0)
    send(verdict.result == Result::pass ? 'P' : verdict.result == Result::fail ? 'F' : 'S', verdict.detail);
}

Verdict run_here(const Rule &rule, const Subject &subject) {
  try {
    const uint32_t kind = subject.type ? subject.type->kind : uint32_t(DFM_KIND_FRICTION);
    const auto run = check_for(rule, kind);
    if (!run) return {Result::skip, "does not apply to this kind of plugin"};
    return {Result::pass, run(subject)};
  } catch (const Broken &b) {
    return {Result::fail, b.what()};
  } catch (const Skipped &s) {
    return {Result::skip, s.what()};
  } catch (const std::exception &e) {
    return {Result::fail,
            text("an exception left the plugin (%s); wrap its entries in dfm::plugin::guarded", e.what())};
  } catch (...) {
    return {Result::fail, "an exception left the plugin; wrap its entries in dfm::plugin::guarded"};
  }
}

Outcome in_fresh_process(const std::string &command, std::vector<std::string> arguments,
                         const Limits &limits) {
  const auto become = [&] {
    fcntl(report, F_SETFD, 0);
    arguments.push_back("--report-to");
    arguments.push_back(std::to_string(report));
    std::vector<char *> argv{const_cast<char *>("deform")};
    for (std::string &a : arguments) argv.push_back(a.data());
    argv.push_back(nullptr);
    // a cache of free pieces would look like a leak to V09
    setenv("GLIBC_TUNABLES", "glibc.malloc.tcache_count=0", 1);
    execv(command.c_str(), argv.data());
    _exit(127);
  };
  return in_own_process(become, limits);
}

std::string same_elsewhere(const Subject &subject, uint64_t digest, const char *kind, const char *input) {
  const std::string number = std::to_string(subject.index), seed = std::to_string(subject.seed);
  const Outcome other =
      in_fresh_process(subject.command, {"plugin", "check", subject.file, "--digest", number, "--seed", seed},
                       {0.5 * subject.limit});
  const std::string mine = text("%016llx", static_cast<unsigned long long>(digest));
  if (!other.spoke)
    broken("in a second process it %s; let the %s depend on its inputs only", other.ending.c_str(), kind);
  if (other.verdict.detail != mine)
    broken(
        "the same %s give %s here and %s in another process; compute from the inputs only, not from "
        "addresses, time or uninitialized memory",
        input, mine.c_str(), other.verdict.detail.c_str());
  return "digest " + mine;
}

namespace {

void open_pipe(int ends[2]) {
  if (pipe2(ends, O_CLOEXEC) != 0)
    throw Failure(
        kBadInput,
        "no pipe could be opened for the process of a rule; close programs or raise the limit of open files");
}

// What the child writes: its reports, and what comes on its standard streams, of which the start is kept.
class Heard {
 public:
  explicit Heard(Outcome &out) : out_(out) {}
  void take_report(const char *bytes, ssize_t n) {
    pending_.append(bytes, static_cast<size_t>(n));
    read_reports(out_, pending_);
  }
  void take_output(const char *bytes, ssize_t n) {
    if (out_.said.size() < 65536) out_.said.append(bytes, static_cast<size_t>(n));
  }

 private:
  Outcome &out_;
  std::string pending_;
};

// What the child wrote before it ended; a process that it left behind is not waited for.
template <class Take>
void read_rest(int fd, Take take) {
  char buffer[4096];
  fcntl(fd, F_SETFL, O_NONBLOCK);
  for (ssize_t n; (n = read(fd, buffer, sizeof buffer)) > 0;) take(buffer, n);
  close(fd);
}

}  // namespace

Outcome in_own_process(const std::function<void()> &work, const Limits &limits) {
  int reports[2], output[2];
  open_pipe(reports);
  open_pipe(output);
  // or the child would print what waits here once more
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) become_child(work, reports[1], output[1]);
  close(reports[1]);
  close(output[1]);
  if (child < 0)
    throw Failure(kBadInput,
                  "the system cannot start another process for a rule; close programs, or use --in-process");
  Outcome out;
  Heard heard(out);
  pollfd ends[2] = {{reports[0], POLLIN, 0}, {output[0], POLLIN, 0}};
  clockid_t clock;
  const bool timed = clock_getcpuclockid(child, &clock) == 0;
  const double begun = clock_of(CLOCK_MONOTONIC);
  char buffer[4096];
  int status = 0;
  double moved = begun, counted = 0;  // when it last computed
  bool waited = false;
  for (bool ended = false; !ended;) {
    poll(ends, 2, ends[0].fd < 0 && ends[1].fd < 0 ? 1 : 5);  // both closed: it ends any moment
    for (int k = 0; k < 2; ++k) {
      if (!(ends[k].revents & (POLLIN | POLLHUP | POLLERR))) continue;
      const ssize_t n = read(ends[k].fd, buffer, sizeof buffer);
      if (n <= 0) ends[k].fd = -1;  // at its end: poll passes over negative descriptors
      else if (k == 0) heard.take_report(buffer, n);
      else heard.take_output(buffer, n);
    }
    if (const double used = timed ? clock_of(clock) : -1; used >= 0) out.seconds = used;
    const double clock_now = clock_of(CLOCK_MONOTONIC);
    if (out.seconds > counted + 1e-3) {
      counted = out.seconds;
      moved = clock_now;
    }
    if (!out.late && clock_now - moved > limits.still && waits(child)) waited = true;
    const bool over = waited || out.seconds > limits.seconds || clock_now - begun > 10 * limits.seconds;
    if (over && !out.late) {
      out.late = true;
      kill(-child, SIGKILL);
      kill(child, SIGKILL);
    }
    ended = waitpid(child, &status, WNOHANG) == child;
  }
  read_rest(reports[0], [&](const char *bytes, ssize_t n) { heard.take_report(bytes, n); });
  read_rest(output[0], [&](const char *bytes, ssize_t n) { heard.take_output(bytes, n); });
  kill(-child, SIGKILL);
  if (!out.spoke)
    out.ending = waited     ? text("did not come back: it has waited for %g s for something that never comes",
                                   limits.still)
                 : out.late ? text("did not come back within %g s", limits.seconds)
                            : ending_of(status);
  return out;
}

}  // namespace cli::check
