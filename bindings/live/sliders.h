// What may be changed while the scene runs: gravity, friction coefficients, stiffness.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "live/simulation.h"

namespace live {

struct Slider {
  std::string name;   // as scripts say it: "mu:upper:floor"
  std::string label;  // as the panel says it
  const char *format = "%.3g";
  double low = 0, high = 1, value = 0, first = 0, saved = 0;
  bool logarithmic = false;
  std::function<void(double)> apply;  // throws cli::Failure where the library refuses
};

// "gravity"; "mu:A:B" of each rule of friction (mu_C and mu_S apart where they differ); "young:BODY" of each
// body whose model takes another one while it runs.
std::vector<Slider> make_sliders(Simulation &simulation);
// Does what a viewer asks for, as doc/reference/stream.md has it. Throws cli::Failure where there is none of
// that name, or its range lacks the value.
void set_slider(std::vector<Slider> &sliders, const cli::JsonValue &request);
std::string slider_text(const Slider &slider);

}  // namespace live
