// The bound of the step: the longest sub-step at which no mode of any body grows (doc/concepts/step.md).
#pragma once
#include "state/world_bound.h"

namespace dfm {

struct Body;
struct World;

// Tetrahedra that are inside out; of other cells those of cells that are at a point of their rule, of a
// lattice those of cells whose material is, in its middle.
uint32_t inverted_cells(const Body &b);

inline constexpr double kBoundShare = 0.9;  // of the bound, that is used

// Strain of an edge, from a bound to the next one, that the rest of the bound pays for.
inline constexpr double kBoundStrain = 0.05;

// Does any body step itself and name a bound for its contacts?
bool any_bounds_contact(const World &w);
bool bound_expired(const World &w);  // does the next sub-step look whether it still holds?
bool bound_is_new(const World &w);   // has it looked since the last sub-step?
void expire_bound(World &w);         // the next one does
void update_bound(World &w);         // w.bound, evaluated again where it may not

// Behind a new contact that holds a body up, gravity strains its edges at a growing rate, which the last
// check did not see. Can this strain exceed what the bound allows for before the next check?
bool gravity_exceeds_bound(const World &w, const Body &b);
void bring_check_forward(World &w, const Body &b);  // so that it cannot

// After bodies have been cut: estimates w.bound for the next step, of dt (s), after which it is evaluated.
// before: w.bound before the cut. share: the bound at rest of the cut bodies over that before. false: no
// estimate, since the bound before is due for a check, or the next step takes more than a few sub-steps.
bool estimate_bound(World &w, const WorldBound &before, double share, double dt);

}  // namespace dfm
