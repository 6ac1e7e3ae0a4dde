// Does a body gain energy without a source? Every body that a force model moves has a balance: its energy
// less the work that loads, motions and contact have done on it. The scheme keeps it, dampers lower it,
// nothing real raises it. What is booked and why the bounds are what they are: doc/concepts/energy_watch.md.
#pragma once
#include <cstdint>

#include "math/vec3.h"
#include "state/energy_book.h"

namespace dfm {

struct StepContext;
struct World;
struct Body;

// The present state of a body, J.
struct EnergyLook {
  double kinetic = 0, elastic = 0, balance = 0, gives_back = 0, rounding = 0;
  bool known = false;  // else it is not watched, or its model did not answer
};

// Gravity that varies: sets the present one, and books what that does to the potentials.
void change_gravity(World &w, Vec3 gravity);
// Why the watch does not look at the body; empty where it does.
const char *unwatched(const World &w, const Body &b);
// Its energy counts in the largest one.
bool has_balance(const Body &b);
// After predict. False: a body, or the contact of a pair, has gained too much; the sentence says which.
bool watch_energy(World &w, StepContext &step, uint32_t *trouble);
// Before commit: what this sub-step puts into the bodies.
void book_energy(World &w, StepContext &step, double motion);
// The host changes what only it can: the next look takes a new base.
void forget_energy(Body &b);
// The same where the host gives the body another shape: what energy it then has is not known where its model
// gives none, and nothing is said about it any more.
void lose_energy(Body &b);
void forget_energy(World &w);

}  // namespace dfm
