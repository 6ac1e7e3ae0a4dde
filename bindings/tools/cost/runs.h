// Runs of choices: child processes of this command, several at a time, each within a limit of time. One that
// has had its slice of processor time is stopped, not ended: it goes on from there when its turn comes again.
// What is done is kept in OUT/runs/KEY and not run again.
#pragma once
#include <chrono>
#include <limits>
#include <string>
#include <vector>

#include "choice.h"
#include "run_folder.h"

namespace cli::cost {

struct Outcome {
  // cut: its limit of time ended it; unstable: it stopped itself; refused: it was not begun
  enum State { none, done, unstable, refused, cut } state = none;
  std::string sentence;           // of a run that is not done
  double cpu = 0, simulated = 0;  // s of processor time in steps, and of the scene
  double took = 0;                // s on the clock, outputs included
  double made = 0;                // s of them until the scene was read and its steps began
  double limit = 0;               // the least of both limits that ended it
  double steps = 0, cells = 0;
  bool kept = false;  // from an earlier call
  bool final_state() const { return state == done || state == unstable || state == refused; }
  // s on the clock that the whole run would take; of a run that was cut an estimate by how far it came,
  // infinity where it came nowhere
  double predicted(double duration) const;
  double cpu_per_s() const { return simulated > 0 ? cpu / simulated : 0; }
};

struct Job {
  std::string label;
  Settings set;
  double limit = 0;                                  // s on the clock
  double work = std::numeric_limits<double>::max();  // s of processor time
  std::string folder;
  Outcome outcome;
};

class Runs {
 public:
  // parallel: how many at a time; budget: s on the clock for this folder, over all calls.
  Runs(const Subject &subject, const std::string &out, unsigned parallel, double budget, bool progress);
  ~Runs();
  Runs(const Runs &) = delete;
  Runs &operator=(const Runs &) = delete;

  // Folder and outcome of an earlier call; kind: what the folder is named after, "runs" or "alone".
  void prepare(Job &job, const std::string &kind = "runs") const;
  // In this order, at most `parallel` at a time, until `keep` s of the budget are left. Throws Failure after
  // a signal.
  void run(const std::vector<Job *> &jobs, unsigned parallel, double keep = 0);
  double left() const;  // s of the budget
  unsigned started() const { return started_; }
  unsigned parallel() const { return parallel_; }
  void expect(size_t jobs) { expected_ = jobs; }  // for the progress line

 private:
  using Clock = std::chrono::steady_clock;
  struct Child {
    int pid = 0;
    Job *job = nullptr;
    Clock::time_point begin;
    double before = 0;      // s at work until it was stopped
    double made = 0;        // of its outcome
    bool notified = false;  // to end
  };
  void start(Job &job, Child &out);
  bool waits(Job &job) const;  // there is nothing to do for it now
  bool ended(Child &child);
  bool pause(Child &child);  // false: there is no memory for more that wait
  void take_result(Child &child, int status);
  void stop_all(std::vector<Child> &children);
  void store(const Job &job) const;
  void keep_spent() const;
  void show(size_t running, size_t waiting);

  HeldFolder held_;
  const Subject &subject_;
  std::string out_;
  unsigned parallel_, started_ = 0;
  size_t expected_ = 0, done_ = 0;
  double budget_, spent_before_ = 0;
  bool progress_, drawn_ = false;
  std::vector<Child> paused_;
  Clock::time_point begin_, shown_;
};

}  // namespace cli::cost
