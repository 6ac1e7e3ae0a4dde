// Checks whether implicit integration pays for bodies whose integrator is left to the library. Costs are
// counted and not timed, so that every run of a scene changes integrators at the same steps. One unit is a
// point or cell in an explicit sub-step, kUnitWork multiplications.
//
// A credit decides. It is counted in seconds of explicit time: the work of explicit sub-steps, with the
// present contacts, for a second of simulated time. Implicit steps add what they save and subtract what they
// cost more. When the credit is used up, the bodies become explicit, from the start of the step that used it
// up. Explicit steps add a share of their time; when that pays for a trial, the bodies become implicit again.
// So trials cost at most that share of explicit time alone, and a body at rest, for which implicit steps are
// cheap, returns to them.
//
// A step of a length that the host gives may cost too much while credit is left. It alone is repeated
// explicitly, but where one such step follows another, the credit from before says nothing about the next:
// after the first one explicit steps must put by again what was lost since implicit steps last saved as much.
#pragma once
#include <cstddef>
#include <string>

namespace dfm {

struct StepContext;
struct World;

// Of the present step.
struct Counting {
  bool on = false;
  double before = 0;   // multiplications: effort of all bodies before the step
  double contact = 0;  // of its contact solves
  double bodies = 0;   // of its bodies, when the solve of the islands began
  // The step is repeated explicitly if it takes more multiplications than explicit time of most_time s would:
  // `most`, and most_touching more for each unit of `touching`. 0: no limit.
  double most_time = 0, most = 0, most_touching = 0;
  double touching = 0;  // units of the contacts of the last sub-step in an explicit one
};

void begin_count(World &w, StepContext &step, double dt);
// After the step: may change the integrator of bodies.
void end_count(World &w, StepContext &step, double dt, double substeps);
// "body 'first' is", "body 'first' and 4 more are"
std::string names_of(const std::string &first, size_t count);
double body_effort(const World &w, const StepContext &step);  // since begin_count()
void count_contacts(const World &w, StepContext &step);       // once they are known, in each sub-step
bool costs_too_much(const Counting &count, double multiplications);

}  // namespace dfm
