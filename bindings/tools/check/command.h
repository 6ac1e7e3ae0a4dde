// `deform plugin check FILE`: what the command line says becomes a run of the rules and a report.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "cli.h"

namespace cli::check {

struct Request {
  std::string file;
  uint64_t seed = 1;
  std::vector<std::string> only;
  bool in_process = false;
  double limit = 10;  // s of processor time for each rule
  // What this program says to itself: which rule of which type, or whose digest, and where to report.
  std::string rule;
  int type = -1, digest = -1, report = -1;
};
// kDone all kept or skipped, kFound a rule is broken, kBadInput no such file or rule.
int run(const Globals &globals, const Request &request);

}  // namespace cli::check
