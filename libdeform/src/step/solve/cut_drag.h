// A tool pays the energy of its cuts along the way that follows, by rows of the contact solve: each is
// between a point of the body beside the cut and the part of the tool that cuts (contact/bond.h,
// doc/decisions/cutting.md). Both get the impulse at that point.
#pragma once

namespace dfm {

struct Body;
struct StepContext;
struct Tool;
struct World;

// Whether cutting the body takes energy: one of its materials has "fracture_energy" above 0.
bool tough(const Body &b);
bool has_dues(const Body &b);
// Ends the tracks of a tool in bodies that it no longer splits, with their remaining energy: no path follows
// that could take it.
void forget_dues(World &w, const Tool &t);

// Appends the rows of this sub-step to the bonds; `again`: as make_bonds().
void make_cut_drags(World &w, StepContext &step, bool again);
// Subtracts the work of the completed sub-step from the remaining energies.
void keep_cut_drags(World &w, StepContext &step);

// Wakes bodies that sleep while a tool moves that has not paid for its cuts in them.
void wake_cut(World &w, StepContext &step);

}  // namespace dfm
