// How long sub-steps are, beside their plan (step_sizes.h): a stage that requires a shorter one asks for it
// here and ends the sub-step, and step.cpp repeats it.
#pragma once

namespace dfm {

struct StepLength {
  double planned = 0;  // s, the sub-step before it was shortened
  // Equal sub-steps that are made of it, and of each that is planned after it; the most that the step has
  // room for.
  double parts = 1, most_parts = 1;
  double next_piece = 0;  // s, with which the rest of the sub-step begins; 0: as a whole

  // What the present attempt says: the sub-step is to be repeated,
  bool repeats = false;
  double factor = 1;     // so many times as long,
  bool divides = false;  // as the first of `parts`,
  bool grows = false;    // and pieces after it begin with twice the length of the one before

  void begin(double length) { *this = {.planned = length, .most_parts = most_parts}; }
  void begin_attempt() {
    repeats = divides = grows = false;
    factor = 1;
  }
  void repeat(double times) {
    repeats = true;
    factor = times;
  }
  // What goes or turns too far is likely to do so in the next piece too.
  void repeat_grown(double times) {
    repeat(times);
    grows = true;
  }
  // h: s, length of this attempt. What is itself a part, or a piece, becomes shorter alone.
  void divide(double h, double into) {
    repeat(1 / into);
    if (h != planned || parts > 1) return;
    parts = into;
    divides = true;
  }
};

}  // namespace dfm
