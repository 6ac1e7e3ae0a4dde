// Changes of a law's state between two sub-steps other than by the contact solve;
// doc/concepts/friction_memory.md.
#pragma once

namespace dfm {

struct StepContext;
struct World;

// Sets state.area, if a law has bristles per area: the present area of the contact, or its target if it
// has none yet. After the warm start.
void share_areas(World &w, StepContext &step);
// After a change of a contact's area: bristles keep their force if it has grown, their deflection if it has
// shrunk, so that their energy never increases.
void fit_bristles(World &w, StepContext &step);
// After the commit: as bristles slide, areas move to where the load is (next_store.due).
void follow_load(World &w, StepContext &step);
// After the commit: frames of laws with tangent state (next_store.tangent) turn with the mean spin of the two
// surfaces about the normal.
void turn_frames(World &w, StepContext &step);

}  // namespace dfm
