#include "runs.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <thread>
#include <utility>

#include "become.h"
#include "cli.h"
#include "file.h"
#include "messages.h"
#include "run_folder.h"

namespace fs = std::filesystem;

namespace cli::cost {
namespace {

constexpr double kMin = 0.02;          // s of the budget with which a run is worth beginning
constexpr double kMemoryShare = 0.25;  // of the machine's memory, for runs that wait
volatile std::sig_atomic_t interrupted = 0;

void on_signal(int) { interrupted = 1; }

bool read_json(const std::string &path, JsonValue &out) {
  std::error_code error;
  if (!fs::exists(path, error)) return false;
  return parse_json(read_file(path, 64u << 20, "JSON"), out);
}

// The last line that the command wrote, without its name and the path of the scene.
std::string last_sentence(const std::string &path, const Subject &subject) {
  std::error_code error;
  if (!fs::exists(path, error)) return "";
  std::string text = read_file(path, 16u << 20, "text");
  while (!text.empty() && text.back() == '\n') text.pop_back();
  text = text.substr(text.rfind('\n') == std::string::npos ? 0 : text.rfind('\n') + 1);
  for (const std::string &begin : {std::string("deform: "), subject.path + ": "})
    if (text.rfind(begin, 0) == 0) text = text.substr(begin.size());
  const size_t end = text.find("; the last good state is in ");
  return text.substr(0, end);
}

// The work of a process that has not ended, by the system's count, whose unit is a hundredth of a second.
double work_of(pid_t pid) {
  FILE *const file = std::fopen(("/proc/" + std::to_string(pid) + "/stat").c_str(), "r");
  if (!file) return 0;
  char text[1024] = {};
  const size_t n = std::fread(text, 1, sizeof text - 1, file);
  std::fclose(file);
  const char *at = n > 0 ? std::strrchr(text, ')') : nullptr;  // behind the name, which may hold anything
  unsigned long user = 0, system = 0;
  if (!at || std::sscanf(at + 1, " %*c %*d %*d %*d %*d %*d %*u %*u %*u %*u %*u %lu %lu", &user, &system) != 2)
    return 0;
  return double(user + system) / double(sysconf(_SC_CLK_TCK));
}

// B of memory that a process holds.
double memory_of(pid_t pid) {
  FILE *const file = std::fopen(("/proc/" + std::to_string(pid) + "/statm").c_str(), "r");
  if (!file) return 0;
  unsigned long size = 0, resident = 0;
  const int read = std::fscanf(file, "%lu %lu", &size, &resident);
  std::fclose(file);
  return read == 2 ? double(resident) * double(sysconf(_SC_PAGESIZE)) : 0;
}

// How far a run has come: the time of the last whole row of its table of bodies.
double recorded_time(const std::string &path) {
  FILE *const file = std::fopen(path.c_str(), "rb");
  if (!file) return 0;
  std::fseek(file, 0, SEEK_END);
  const long size = std::ftell(file), n = std::min(size, 4096L);
  std::fseek(file, size - n, SEEK_SET);
  std::string text(size_t(n), '\0');
  text.resize(std::fread(text.data(), 1, size_t(n), file));
  std::fclose(file);
  const size_t end = text.rfind('\n');
  if (end == std::string::npos || end == 0) return 0;
  const size_t begin = text.rfind('\n', end - 1);
  return begin == std::string::npos ? 0 : std::strtod(text.c_str() + begin + 1, nullptr);
}

}  // namespace

double Outcome::predicted(double duration) const {
  if (state != cut) return took;
  return simulated > 0 ? made + (took - made) * duration / simulated
                       : std::numeric_limits<double>::infinity();
}

Runs::Runs(const Subject &subject, const std::string &out, unsigned parallel, double budget, bool progress)
    : held_(out),
      subject_(subject),
      out_(out),
      parallel_(parallel),
      budget_(budget),
      progress_(progress && isatty(STDERR_FILENO)),
      begin_(Clock::now()),
      shown_(begin_ + std::chrono::seconds(2)) {
  make_folder(out_ + "/runs");
  JsonValue spent;
  if (read_json(out_ + "/runs/spent.json", spent) &&
      spent.get("fingerprint") == std::to_string(subject.fingerprint))
    spent_before_ = spent.scalar("seconds");
  struct sigaction action = {};
  action.sa_handler = on_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

Runs::~Runs() {
  for (Child &child : paused_) kill(child.pid, SIGKILL);
  for (Child &child : paused_) waitpid(child.pid, nullptr, 0);
  if (drawn_) std::fprintf(stderr, "\r\033[K");
}

double Runs::left() const {
  return budget_ - spent_before_ - std::chrono::duration<double>(Clock::now() - begin_).count();
}

void Runs::keep_spent() const {
  write_whole(
      out_ + "/runs/spent.json",
      json_object("fingerprint", quoted(std::to_string(subject_.fingerprint)), "seconds", budget_ - left()) +
          "\n");
}

void Runs::prepare(Job &job, const std::string &kind) const {
  Hash key;
  key.add(std::to_string(subject_.fingerprint));
  for (const auto &[pointer, value] : job.set) key.add(pointer).add(value);
  job.folder = out_ + "/" + kind + "/" + key.hex();
  JsonValue kept;
  if (!read_json(job.folder + "/outcome.json", kept)) return;
  Outcome &o = job.outcome;
  o.state = Outcome::State(int(kept.scalar("state")));
  o.sentence = kept.get("sentence");
  o.cpu = kept.scalar("cpu_s");
  o.simulated = kept.scalar("simulated_s");
  o.took = kept.scalar("took_s");
  o.made = kept.scalar("made_s");
  o.limit = kept.scalar("limit_s");
  o.steps = kept.scalar("steps");
  o.cells = kept.scalar("cells");
  o.kept = true;
}

void Runs::store(const Job &job) const {
  const Outcome &o = job.outcome;
  write_whole(job.folder + "/outcome.json",
              json_object("label", quoted(job.label), "state", int(o.state), "sentence", quoted(o.sentence),
                          "cpu_s", o.cpu, "simulated_s", o.simulated, "took_s", o.took, "limit_s", o.limit,
                          "steps", o.steps, "cells", o.cells, "made_s", o.made) +
                  "\n");
}

void Runs::start(Job &job, Child &out) {
  const auto waiting = std::ranges::find_if(paused_, [&](const Child &c) { return c.job == &job; });
  if (waiting != paused_.end()) {
    out = *waiting;
    paused_.erase(waiting);
    out.begin = Clock::now();
    kill(out.pid, SIGCONT);
    return;
  }
  std::error_code error;
  std::filesystem::remove_all(job.folder, error);  // an earlier try
  make_folder(job.folder);
  std::vector<std::string> words = {beside("deform"), "run", subject_.path, "--out", job.folder, "--quiet"};
  for (const auto *const settings : {&subject_.planned, &std::as_const(job.set)})
    for (const auto &[pointer, value] : *settings) {
      words.push_back("--set");
      words.push_back(pointer + "=" + value);
    }
  std::vector<char *> argv;
  for (std::string &w : words) argv.push_back(w.data());
  argv.push_back(nullptr);
  const std::string log = job.folder + "/stderr.txt";
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid < 0) throw Failure(kBadInput, std::string("a run cannot be started: ") + std::strerror(errno));
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // ends with this command, however that ends
    if (getppid() != parent) _exit(127);
    const int none = open("/dev/null", O_RDWR);
    const int err = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    dup2(none, STDIN_FILENO);
    dup2(none, STDOUT_FILENO);
    dup2(err < 0 ? none : err, STDERR_FILENO);
    execv(argv[0], argv.data());
    _exit(127);
  }
  out.pid = pid;
  out.job = &job;
  out.begin = Clock::now();
  ++started_;
}

bool Runs::pause(Child &child) {
  double held = memory_of(child.pid);
  for (const Child &other : paused_) held += memory_of(other.pid);
  const double all = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGESIZE));
  if (held > kMemoryShare * all || kill(child.pid, SIGSTOP) != 0) return false;
  Outcome &o = child.job->outcome;
  child.before += std::chrono::duration<double>(Clock::now() - child.begin).count();
  o = {};
  o.state = Outcome::cut;
  o.took = child.before;
  o.made = child.made;
  o.limit = o.cpu = work_of(child.pid);
  o.simulated = recorded_time(child.job->folder + "/bodies.csv");
  store(*child.job);
  paused_.push_back(child);
  return true;
}

bool Runs::ended(Child &child) {
  Job &job = *child.job;
  const double now = std::chrono::duration<double>(Clock::now() - child.begin).count();
  int status = 0;
  if (child.made == 0 && access((job.folder + "/bodies.csv").c_str(), F_OK) == 0)
    child.made = child.before + now;
  if (waitpid(child.pid, &status, WNOHANG) == 0) {
    if (now > job.limit + 10) kill(child.pid, SIGKILL);
    if (child.notified) return false;
    if (work_of(child.pid) <= job.work && now <= job.limit) return false;
    if (left() > kMin && pause(child)) return true;
    kill(child.pid, SIGTERM);
    child.notified = true;
    return false;
  }
  child.before += now;
  take_result(child, status);
  return true;
}

void Runs::take_result(Child &child, int status) {
  Job &job = *child.job;
  Outcome &o = job.outcome;
  o = {};
  o.took = child.before;
  o.made = child.made;
  o.limit = std::min(job.limit, job.work);
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  JsonValue summary;
  const bool whole = read_json(job.folder + "/summary.json", summary);
  o.cpu = summary.scalar("cpu_s");
  o.simulated = summary.scalar("simulated_s");
  o.steps = summary.scalar("steps");
  if (const JsonValue *const bodies = summary.find("bodies"))
    for (const JsonMember &body : bodies->members) o.cells += body.value.scalar("cells");
  o.sentence = last_sentence(job.folder + "/stderr.txt", subject_);
  if (code == kDone && whole && summary.get("finite") == "true") {
    o.state = Outcome::done;
    o.sentence.clear();
  } else if (child.notified && code != kStopped) {
    o.state = Outcome::cut;
    o.sentence.clear();
  } else if (code == kStopped || code == kDone) {
    o.state = Outcome::unstable;
    if (code == kDone) o.sentence = "numbers are not finite";
  } else {
    o.state = Outcome::refused;
    if (o.sentence.empty()) o.sentence = "the run ended with code " + std::to_string(code);
  }
  // What somebody else has killed says nothing of the choice: a later call makes it again.
  if (child.notified || (code != 128 + SIGKILL && code != 128 + SIGTERM && code != kInterrupted)) store(job);
  ++done_;
}

void Runs::stop_all(std::vector<Child> &children) {
  for (const Child &child : children) kill(child.pid, SIGTERM);
  const Clock::time_point begin = Clock::now();
  for (Child &child : children) {
    int status = 0;
    while (waitpid(child.pid, &status, WNOHANG) == 0) {
      if (Clock::now() - begin > std::chrono::seconds(5)) kill(child.pid, SIGKILL);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
}

bool Runs::waits(Job &job) const {
  if (job.limit < kMin || job.outcome.final_state()) return true;
  if (job.outcome.state != Outcome::cut) return false;
  const auto same = [&](const Child &c) { return c.job == &job; };
  const bool goes_on = std::ranges::any_of(paused_, same);
  const double need = job.outcome.predicted(subject_.duration) - (goes_on ? job.outcome.took : 0);
  const bool slice = job.work < std::numeric_limits<double>::max();  // need not come to its end
  // how far a search for an equilibrium has come is unknown: it is tried
  const bool too_long = need > job.limit && !(subject_.at_rest && std::isinf(need));
  return job.work <= job.outcome.limit || (!slice && too_long);
}

void Runs::show(size_t running, size_t waiting) {
  if (!progress_ || Clock::now() < shown_) return;
  shown_ = Clock::now() + std::chrono::milliseconds(200);
  std::fprintf(stderr, "\r%zu of about %zu runs done, %zu at work, %zu waiting, at most %.0f s left \033[K",
               done_, std::max(expected_, done_ + running + waiting), running, waiting,
               std::max(0.0, left()));
  std::fflush(stderr);
  drawn_ = true;
}

void Runs::run(const std::vector<Job *> &jobs, unsigned parallel, double keep) {
  std::vector<Child> children;
  size_t next = 0;
  try {
    while (next < jobs.size() || !children.empty()) {
      if (interrupted)
        throw Failure(kInterrupted, "interrupted; the runs that are done are kept in " + out_ +
                                        ", and the same call continues from there");
      while (next < jobs.size() && children.size() < parallel) {
        Job &job = *jobs[next++];
        job.limit = std::min(job.limit, left() - keep);
        if (waits(job)) continue;
        children.emplace_back();
        start(job, children.back());
      }
      const size_t before = children.size();
      children.erase(std::remove_if(children.begin(), children.end(), [&](Child &c) { return ended(c); }),
                     children.end());
      if (children.size() != before) keep_spent();
      show(children.size(), jobs.size() - next);
      if (children.size() == before) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  } catch (...) {
    stop_all(children);
    throw;
  }
  keep_spent();
}

}  // namespace cli::cost
