// Runs a rule here, or in a process with a limit, so that a crash or a hang ends only that rule.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "check/check.h"

namespace cli::check {

// Processor time for one rule; the clock's limit is ten times that. What neither computes nor may run for
// `still` seconds waits for something that never comes.
struct Limits { double seconds = 10, still = 5; };

// What a rule is about to do: named where its process ends without an answer.
void stage(const char *format, ...) DEFORM_PRINTF(1, 2);

// The child's side: where stages and the verdict go; -1: this process is not a child.
void report_to(int descriptor);
void suppress_crash_dialogs();  // of Windows, which wait for an answer

struct Outcome {
  bool spoke = false;  // the process gave a verdict
  Verdict verdict;
  std::string said;    // what it wrote to its standard streams
  std::string ending;  // where it gave none: "ended by SIGSEGV", "ran past 1 s of processor time"
  std::string at;      // its last stage
  double seconds = 0;  // processor time
  bool late = false;   // it was ended because it did not come back
};
// Runs work in a process of its own, which has loaded no plugin before, and waits within the limits. A system
// without fork() starts the command, which these arguments have do the same.
Outcome in_own_process(const std::function<void()> &work, const std::string &command,
                       const std::vector<std::string> &arguments, const Limits &limits);
// A new process of this program, at other addresses; --report-to is added to the arguments.
Outcome in_fresh_process(const std::string &command, std::vector<std::string> arguments,
                         const Limits &limits);
// The digest, if a fresh process finds the same; else throws Broken. kind: "law"; input: "batches".
std::string same_elsewhere(const Subject &subject, uint64_t digest, const char *kind, const char *input);
// The child's last word.
void send_verdict(const Verdict &verdict);

}  // namespace cli::check
