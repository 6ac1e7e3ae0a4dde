// Does a body gain energy that nobody gave it? Every body that a force model moves has a balance: its energy
// less the work that loads, motions and contact have done on it. The scheme keeps it, dampers lower it,
// nothing real raises it. What is booked and why the bounds are what they are: doc/concepts/energy_watch.md.
#pragma once
#include <cstdint>

#include "math/vec3.h"

namespace dfm {

struct StepContext;
struct World;
struct Body;

// Of one body. Lasts.
struct EnergyBook {
  uint32_t known = 0;  // looks since the host last changed anything, the first few of which take the base
  double base = 0;     // J, least balance so far, with what the stiff modes may give back
  double work = 0;     // J, since base was first taken
  double kinetic = 0;  // J, when last looked at
};

inline constexpr uint32_t kMostCredit = 4096;  // sub-steps

// Of the world. Lasts.
struct EnergyWatch {
  // sub-steps without a look, less what looks have cost: new bases wait for it where the host changes
  // something all the time
  uint32_t credit = kMostCredit;
  uint32_t age = ~0u;  // sub-steps since the energies were last looked at
  double last_h = 0;   // s, of the last sub-step
  // the next one is longer or shorter because the step's bound has it so; not state: said anew by each step
  bool new_size = false;
};

// Gravity that varies: sets the present one, and books what that does to the potentials.
void change_gravity(World &w, Vec3 gravity);
// After predict. False: a body has gained too much; the sentence says which.
bool watch_energy(World &w, StepContext &step, uint32_t *trouble);
// Before commit: what this sub-step puts into the bodies.
void book_energy(World &w, StepContext &step, double motion);
// The host changes what only it can: the next look takes a new base.
void forget_energy(Body &b);
void forget_energy(World &w);

bool sound(const EnergyBook &e);  // could a world have come to it?
bool sound(const EnergyWatch &e);

}  // namespace dfm
