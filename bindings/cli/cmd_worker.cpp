// deform worker: runs one scene after the other for deform.sweep (bindings/python/deform/study/engine.py), so
// that none of them waits for a program and its plugins to be loaded. Each run is a process of its own,
// forked from this one: what is global in a run is new each time, and a run that crashes ends nothing else.
//
// Standard input: a line for each run, {"scene": FILE, "out": FOLDER, "set": ["/pointer=value", ..]}. Who
// closes it during a run does not wait for the run, which is ended.
// Standard output: a line for each run, {"code": exit code, "signal": what ended it, or 0, "said": error}.
// Plugins and runs have /dev/null for both.
#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

#include "arguments.h"
#include "cli.h"
#include "json_text.h"
#include "leaving.h"
#include "messages.h"
#include "run.h"

namespace cli {
namespace {

[[noreturn]] void run_in_child(const RunOptions &options, const Globals &globals, pid_t worker, int errors) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // nobody would read its results
  if (getppid() != worker) _exit(leave(kBadInput));
  dup2(errors, STDERR_FILENO);
  int code = kDone;
  try {
    run_scene(options, globals);
  } catch (const Failure &failure) {
    fail(failure.what());
    code = failure.exit_code;
  } catch (const std::exception &error) {
    code = fail(error.what());
  }
  std::fflush(stderr);
  _exit(leave(code));
}

// The last line of what a run wrote to standard error: its sentence.
std::string last_line(int file) {
  char text[4096];
  const off_t size = lseek(file, 0, SEEK_END);
  const off_t from = std::max<off_t>(0, size - off_t(sizeof text));
  const ssize_t n = pread(file, text, sizeof text, from);
  std::string all(text, size_t(std::max<ssize_t>(0, n)));
  while (!all.empty() && all.back() == '\n') all.pop_back();
  return all.substr(all.rfind('\n') + 1);
}

[[noreturn]] void fail_worker(const char *what) {
  throw Failure(kBadInput, std::string("worker: ") + what + ": " + std::strerror(errno));
}

struct Streams { FILE *requests, *replies; };

// The streams the worker was started with; the standard streams are /dev/null from here on.
Streams take_streams() {
  const int in = fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 3), out = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3);
  const int null = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  if (in < 0 || out < 0 || null < 0) fail_worker("no streams");
  dup2(null, STDIN_FILENO);
  dup2(null, STDOUT_FILENO);
  close(null);
  return {fdopen(in, "r"), fdopen(out, "w")};
}

bool read_line(FILE *file, std::string &line) {
  line.clear();
  int c;
  while ((c = std::getc(file)) != EOF && c != '\n') line += char(c);
  return c != EOF;
}

// Waits until the run has closed its end of a pipe, which it does by ending, or the caller is gone.
void wait_for(pid_t child, int run, int caller) {
  pollfd ends[] = {{run, 0, 0}, {caller, 0, 0}};
  while (!(ends[0].revents & POLLHUP)) {
    if (poll(ends, 2, -1) < 0 && errno != EINTR) fail_worker("poll");
    if (ends[1].revents & POLLHUP) {
      kill(child, SIGKILL);
      return;
    }
  }
}

void handle_requests(const RunOptions &options, const Globals &globals, const Streams &streams) {
  const int errors = memfd_create("errors", MFD_CLOEXEC);
  if (errors < 0) fail_worker("no memory file");
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) fail_worker("no pipe");
  const pid_t worker = getpid();
  const pid_t child = fork();
  if (child < 0) fail_worker("no process");
  if (child == 0) run_in_child(options, globals, worker, errors);
  close(ends[1]);
  wait_for(child, ends[0], fileno(streams.requests));
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) fail_worker("waitpid");
  const bool ended = WIFEXITED(status);
  JsonObject reply;
  reply.add("code", ended ? WEXITSTATUS(status) : -1, "signal", ended ? 0 : WTERMSIG(status), "said",
            quoted(last_line(errors)));
  close(errors);
  std::fprintf(streams.replies, "%s\n", reply.text().c_str());
  std::fflush(streams.replies);
}

void work(Globals &globals) {
  globals.quiet = true;
  const Streams streams = take_streams();
  // each child has its own copy, with the plugins loaded
  offer_context(make_context(globals));
  for (std::string line; read_line(streams.requests, line);) {
    JsonValue request;
    if (!parse_json(line, request))
      throw Failure(kBadInput, "worker: expected a line of JSON, found \"" + line + "\"");
    RunOptions options;
    options.scene = request.get("scene");
    options.out = request.get("out");
    for (const JsonValue &value : request.list("set")) options.set.push_back(value.text);
    handle_requests(options, globals, streams);
  }
}

}  // namespace

void add_worker(Command app, Globals &globals, int *exit_code) {
  Command sub = app.command("worker", "runs the scenes that lines on standard input name (deform.sweep)");
  sub.hide();
  sub.calls([&globals, exit_code] {
    work(globals);
    *exit_code = kDone;
  });
}

}  // namespace cli
