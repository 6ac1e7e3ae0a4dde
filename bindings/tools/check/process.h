// What runner_posix.cpp and runner_windows.cpp share: a child is heard and waited for in the same way.
#pragma once
#include <functional>
#include <string>

#include "check/runner.h"

namespace cli::check {

int reports();                            // the descriptor of report_to()
void keep_from_children(int descriptor);  // the system's

// What the child writes: its reports, and what comes on its standard streams, of which the start is kept.
class Heard {
 public:
  explicit Heard(Outcome &out) : out_(out) {}
  void take_report(const char *bytes, size_t n);
  void take_output(const char *bytes, size_t n);

 private:
  Outcome &out_;
  std::string pending_;
};

// How long a child is waited for.
class Patience {
 public:
  Patience(const Limits &limits, Outcome &out, double clock)
      : limits_(limits), out_(out), begun_(clock), moved_(clock) {}
  // Takes the processor time of the child and the clock; true: it is to be ended. waits: is it waiting, for
  // neither the processor nor a disk?
  bool ends(double used, double clock, const std::function<bool()> &waits);
  std::string ending() const;

 private:
  const Limits limits_;
  Outcome &out_;
  double begun_, moved_, counted_ = 0;  // moved: when it last computed
  bool waited_ = false;
};

}  // namespace cli::check
