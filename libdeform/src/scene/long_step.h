// Warns of implicit bodies that are small for the step.
#pragma once
#include "state/world.h"

namespace dfm::scene {

// Explicit time cuts a step into stable sub-steps; implicit time takes it whole. A body that falls through
// many of its own sizes in it is far inside of what it lands on, and the search for the moment of contact
// takes most of the time. step: s, as the scene names it.
void tell_long_step(dfm_context *context, const World &world, double step);

}  // namespace dfm::scene
