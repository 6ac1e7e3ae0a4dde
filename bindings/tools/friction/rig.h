// The rig of `deform friction`: drives one contact as the case says and records a row at each of
// its output times.
#pragma once
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "case.h"
#include "law.h"
#include "progress.h"

namespace cli {

struct RigResult {
  std::vector<std::string> columns;
  std::vector<std::vector<double>> rows;
  std::vector<std::pair<std::string, std::vector<double>>> figures;  // what the run showed, by name
  // jumps: steps that ended on a jump of a law that does not say that it has one
  uint64_t steps = 0, jumps = 0;
  std::string stopped;  // why it stopped before its time; empty where it did not
};

// step: the longest step, s; each interval between rows is cut into equal ones.
RigResult run_rig(const FrictionCase &rig, RigLaw &law, double step, Progress &progress);

}  // namespace cli
