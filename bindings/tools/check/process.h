// What runner_posix.cpp and runner_windows.cpp share: a child is heard and waited for in the same way.
#pragma once
#include <chrono>
#include <functional>
#include <string>

#include "check/runner.h"

namespace cli::check {

int reports();  // the descriptor of report_to()
void keep_from_children(int descriptor);

inline constexpr const char *kNoPipe =
    "no pipe could be opened for the process of a rule; close programs or raise the limit of open files";
inline constexpr const char *kNoProcess =
    "the system cannot start another process for a rule; close programs, or use --in-process";

// What the child writes: its reports, and what comes on its standard streams, of which the start is kept.
class ChildOutput {
 public:
  explicit ChildOutput(Outcome &out) : out_(out) {}
  void take_report(const char *bytes, size_t n);
  void take_output(const char *bytes, size_t n);

 private:
  Outcome &out_;
  std::string pending_;
};

// How long a child is waited for.
class TimeLimit {
 public:
  TimeLimit(const Limits &limits, Outcome &out) : limits_(limits), out_(out) {}
  // Takes the processor time of the child; true: it is to be ended. waits: is it waiting, for neither the
  // processor nor a disk?
  bool ends(double used, const std::function<bool()> &waits);
  std::string ending() const;

 private:
  using Clock = std::chrono::steady_clock;
  const Limits limits_;
  Outcome &out_;
  const Clock::time_point begun_ = Clock::now();
  Clock::time_point moved_ = begun_;  // when it last computed
  double counted_ = 0;
  bool waited_ = false;
};

}  // namespace cli::check
