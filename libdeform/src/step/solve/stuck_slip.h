// Slip that the solves have left over where contacts stick, taken back in later sub-steps (stuck_slip.cpp).
#pragma once

namespace dfm {

struct SolveIsland;
struct StepContext;
struct World;

// Before the solves: nothing is owed yet. Without laws that hold places StepContext::owed is empty.
void reset_stick_drift(const World &w, StepContext &step);
// Once the tolerances of an island are known: part of what its contacts owe is added to the slip that the
// solve makes zero.
void find_slip_back(const World &w, StepContext &step, SolveIsland &own);
// After the island's solve: its rows give the slip of the surfaces again.
void restore_drive(StepContext &step, const SolveIsland &own);
// After all solves: so does the state; StepContext::owed becomes what contacts owe the next sub-step.
void update_stick_drift(const World &w, StepContext &step);

}  // namespace dfm
