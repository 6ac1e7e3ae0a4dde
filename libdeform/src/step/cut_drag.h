// What a tool owes for its cuts it pays over the way that follows: rows of the contact solve, each between a
// point of the body beside the cut and the part cutting (contact/bond.h, decision 0402). Both get the impulse
// at the point.
#pragma once

namespace dfm {

struct Body;
struct StepContext;
struct World;

// Takes energy to be cut: a material of it has "fracture_energy" above 0.
bool tough(const Body &b);
bool has_dues(const Body &b);

// Appends the rows of this sub-step to the bonds; `again`: as make_bonds().
void make_cut_drags(World &w, StepContext &step, bool again);
// Subtracts the work of the completed sub-step from the energies due.
void keep_cut_drags(World &w, StepContext &step);

// Wakes bodies that sleep while the tool that owes them something moves.
void wake_cut(World &w, StepContext &step);

}  // namespace dfm
