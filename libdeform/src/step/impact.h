// A hard impact on a body that the library has made implicit, in a step whose length the library has chosen:
// contact takes the velocity of the body in one sub-step, and with it the energy that would throw it back.
// Such a step is repeated explicitly, and the body stays explicit until the impact is over;
// doc/decisions/implicit_time.md.
#pragma once
#include <cstdint>

namespace dfm {

struct StepContext;
struct World;

// Whether the library has chosen the length of the next step. Steps of the announced length are the host's;
// others that are no longer than the offered one follow the errors of implicit bodies.
bool chosen_by_library(const World &w, double dt);
// Before a sub-step is committed: ends the step if one of its bodies has been struck, or warns where it may
// not be repeated.
void check_for_impact(World &w, const StepContext &step);
// Why bodies that move by this implicit integrator will not rebound: a clause.
const char *why_no_rebound(uint32_t integrator);
// Begins again from the state before the step, explicitly until the impact is over.
void begin_impact(World &w, double dt);
// After a step: whether it belongs to an impact, whose steps are not counted. The last one makes bodies
// implicit again.
bool goes_on_after_impact(World &w, double dt);
// Ends the present step for that reason.
[[noreturn]] void end_struck_step();

}  // namespace dfm
