// What a law's state goes through between two sub-steps beside the contact solve;
// doc/concepts/friction_memory.md.
#pragma once

namespace dfm {

struct StepContext;
struct World;

// state.area, where some law has bristles per area: what the contact stood for so far, or what it should
// (aim) where it stands nowhere yet. After the warm start.
void share_areas(World &w, StepContext &step);
// Where a contact's area has changed: its bristles keep their force where it has grown, their deflection
// where it has shrunk; what they store never rises.
void fit_bristles(World &w, StepContext &step);
// After the commit: as bristles slide, contacts' areas go where the load asks for them (next_store.due).
void follow_load(World &w, StepContext &step);
// After the commit: frames of laws with tangent state (next_store.tangent) turn with the mean spin of the two
// surfaces about the normal.
void turn_frames(World &w, StepContext &step);

}  // namespace dfm
