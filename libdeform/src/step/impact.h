// A hard impact on a body that the library has made implicit, in a step whose length the library has chosen:
// contact takes the velocity of the body in one sub-step, and with it the energy that would throw it back.
// Such a sub-step is repeated explicitly, and all such bodies stay explicit until the impact is over;
// doc/decisions/implicit_time.md.
#pragma once
#include <cstdint>

namespace dfm {

struct StepContext;
struct World;

// Whether the library has chosen the length of the next step. Steps of the announced length are the host's;
// others that are no longer than the offered one follow the errors of implicit bodies.
bool chosen_by_library(const World &w, double dt);
// Before a sub-step is committed: whether one of its bodies has an impact, so that the sub-step is to be
// repeated after begin_impact(). Warns where it may not be repeated.
bool has_impact(World &w, const StepContext &step);
// Why bodies that move by this implicit integrator will not rebound: a clause.
const char *why_no_rebound(uint32_t integrator);
// Makes the implicit bodies of the library's choice explicit until the impact is over. The world must be
// prepared again.
void begin_impact(World &w);
// Makes them implicit again: when it is over, or sooner where explicit time needs too many sub-steps. False:
// there are none.
bool end_impact(World &w);
// Takes back what began or ended an impact in a step that is taken back. until: w.impact_until before that
// step.
void undo_impact(World &w, double until);
// After each step.
void follow_impact(World &w, double dt);

}  // namespace dfm
