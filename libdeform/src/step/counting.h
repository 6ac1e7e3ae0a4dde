// Whether implicit time pays where it was left to the library. Costs are counted, never timed, so that every
// run of a scene changes integrators at the same steps: units are points and cells in an explicit sub-step,
// kUnitWork multiplications each.
//
// Implicit steps draw on a purse what they take beyond the explicit sub-steps of the same time, and put in
// what they save. Where it is empty the bodies go on explicitly, from the start of the step whose work has
// emptied it. Explicit steps put in a share of their work; once that is enough for a try, the bodies are
// implicit again. So what is lost to tries is at most that share of what explicit time alone would take, and
// a body at rest, for which implicit steps are cheap, finds back to them.
#pragma once

namespace dfm {

struct StepContext;
struct World;

// Of the present step.
struct Counting {
  bool on = false;
  double before = 0;   // multiplications: effort of all bodies before it
  double contact = 0;  // of its contact solves
  double bodies = 0;   // of its bodies, as the islands began to be solved
  double most = 0;     // above which it is given up; 0: never
};

void begin_count(World &w, StepContext &step, double dt);
// After the step: bodies may move by another integrator from now on.
void end_count(World &w, StepContext &step, double dt, double substeps);
double body_effort(const World &w, const StepContext &step);  // since begin_count()

}  // namespace dfm
