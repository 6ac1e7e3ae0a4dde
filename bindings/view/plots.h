// What is plotted over simulated time: energy, how far each probe is from its start, the time of a step.
#pragma once
#include <string>
#include <vector>

#include "simulation.h"

namespace view {

struct Curve {
  std::string name;
  std::vector<float> values;
};

struct Plot {
  std::string title, unit;
  std::vector<Curve> curves;
  bool measured = false;  // differs from run to run
};

class Plots {
 public:
  explicit Plots(const Simulation &simulation);
  void sample();  // where simulated time has gone on
  void clear();
  const std::vector<Plot> &plots() const { return plots_; }
  const std::vector<double> &times() const { return times_; }

 private:
  const Simulation &simulation_;
  std::vector<Plot> plots_;
  std::vector<double> times_, starts_;  // s; [nprobe,3] m
};

}  // namespace view
