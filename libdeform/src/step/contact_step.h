// The longest sub-step that contacts allow where no stability bound is shorter.
#pragma once

namespace dfm {

struct StepContext;
struct World;

// s, infinite: any. A contact is linear where a sub-step begins, and a sub-step has contacts with all within
// its reach (contact/reach.h). So of two bodies, or a body and a mesh, that meet within dt (s) at their
// present velocities, the reach is no more than an edge of their surfaces. Obstacles of simple shapes set no
// limit, since a surfel has few contacts with them, nor do pairs of rigid things (step/rigid/tool_touch.h).
// Where a bound is shorter, state/step_sizes.h chooses; no time passes in a search for an equilibrium.
double contact_step(World &w, StepContext &step, double dt);

}  // namespace dfm
