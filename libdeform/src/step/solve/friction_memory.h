// What contacts remember of their friction between two sub-steps, beside what the contact solve does with it
// (doc/concepts/friction_memory.md): bristles of laws with a state (bristles.cpp), and slip that the solves
// have left over where contacts of other laws stick, taken back in later sub-steps (stuck_slip.cpp).
#pragma once

namespace dfm {

struct SolveIsland;
struct StepContext;
struct World;

// Sets state.area, if a law has bristles per area: the present area of the contact, or its target if it
// has none yet. After the warm start.
void share_areas(World &w, StepContext &step);
// After a change of a contact's area: bristles keep their force if it has grown, their deflection if it has
// shrunk, so that their energy never increases.
void fit_bristles(World &w, StepContext &step);
// After the commit: as bristles slide, areas move to where the load is (next_store.next_area).
void follow_load(World &w, StepContext &step);
// After the commit: frames of laws with tangent state (next_store.turned) turn with the mean spin of the two
// surfaces about the normal.
void turn_frames(World &w, StepContext &step);

// Before the solves: no slip is to be taken back yet. Without laws that hold places StepContext::stick_drift
// is empty.
void reset_stick_drift(const World &w, StepContext &step);
// Once the tolerances of an island are known: part of the slip error of its contacts is added to the slip
// that the solve makes zero.
void find_slip_back(const World &w, StepContext &step, SolveIsland &own);
// After the island's solve: its rows give the slip of the surfaces again.
void restore_drive(StepContext &step, const SolveIsland &own);
// After all solves: so does the state; StepContext::stick_drift becomes what contacts owe the next sub-step.
void update_stick_drift(const World &w, StepContext &step);

}  // namespace dfm
