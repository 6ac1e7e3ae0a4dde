// deform worker: runs one scene after the other for deform.sweep (bindings/python/deform/study/engine.py), so
// that none of them waits for a program and its plugins to be loaded. Each run is a process of its own,
// forked from this one: what is global in a run is new each time, and a run that crashes ends nothing else.
//
// Standard input: a line for each run, {"scene": FILE, "out": FOLDER, "set": ["/pointer=value", ..]}.
// Standard output: a line for each run, {"code": exit code, "signal": what ended it, or 0, "said": error}.
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <iostream>

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

void answer(const RunOptions &options, const Globals &globals) {
  const int errors = memfd_create("errors", MFD_CLOEXEC);
  if (errors < 0) throw Failure(kBadInput, std::string("worker: no memory file: ") + std::strerror(errno));
  const pid_t worker = getpid();
  const pid_t child = fork();
  if (child < 0) throw Failure(kBadInput, std::string("worker: no process: ") + std::strerror(errno));
  if (child == 0) run_in_child(options, globals, worker, errors);
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) throw Failure(kBadInput, std::string("worker: waitpid: ") + std::strerror(errno));
  const bool ended = WIFEXITED(status);
  JsonObject reply;
  reply.add("code", std::to_string(ended ? WEXITSTATUS(status) : -1));
  reply.add("signal", std::to_string(ended ? 0 : WTERMSIG(status))).add("said", quoted(last_line(errors)));
  close(errors);
  std::printf("%s\n", reply.text().c_str());
  std::fflush(stdout);
}

void work(Globals &globals) {
  globals.quiet = true;
  // each child has its own copy, with the plugins loaded
  offer_context(make_context(globals));
  for (std::string line; std::getline(std::cin, line);) {
    JsonValue request;
    if (!parse_json(line, request))
      throw Failure(kBadInput, "worker: expected a line of JSON, found \"" + line + "\"");
    RunOptions options;
    options.scene = request.get("scene");
    options.out = request.get("out");
    for (const JsonValue &value : request.list("set")) options.set.push_back(value.text);
    answer(options, globals);
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
