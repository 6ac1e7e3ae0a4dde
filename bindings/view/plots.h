// What is plotted over simulated time: energy, how far each probe is from its start, what tools feel, and the
// time of a step.
#pragma once
#include <string>
#include <vector>

#include "live/grip.h"
#include "live/simulation.h"

namespace view {

struct Curve {
  std::string name;
  std::vector<float> values;
};

struct Plot {
  std::string title, unit;
  std::vector<Curve> curves;
  bool measured = false;        // differs from run to run
  int tool = -1;                // number of the tool that it is about
  std::vector<double> times{};  // s
  // One for each curve; where a new time begins, and the oldest ones are dropped.
  void add(double time, const double *values);
  void clear();
};

class Plots {
 public:
  Plots(const live::Simulation &simulation, const live::Grip &grip);
  void sample();  // where simulated time has gone on
  void clear();
  const std::vector<Plot> &plots() const { return plots_; }

 private:
  const live::Simulation &simulation_;
  const live::Grip &grip_;
  std::vector<Plot> plots_;
  std::vector<double> starts_;  // [nprobe,3] m
};

}  // namespace view
