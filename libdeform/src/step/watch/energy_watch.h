// Detects bodies that gain energy without a source. Every body that a force model moves has a balance: its
// energy less the work that loads, motions and contact have done on it. The scheme keeps it, dampers lower
// it, and nothing real raises it. What is booked, and the reasons for the bounds:
// doc/concepts/energy_watch.md.
#pragma once
#include <cstdint>

#include "dynamics/dynamics.h"
#include "math/vec3.h"

namespace dfm {

struct Body;
struct Entities;
struct Rules;
struct StepContext;
struct World;
struct WorldState;

// The present state of a body, J.
struct EnergySample {
  double kinetic = 0, elastic = 0, balance = 0, returned = 0, rounding = 0;
  bool known = false;  // else it is not watched, or its model did not answer
};

// Sets the present gravity, if it varies, and books what the change does to the potentials.
void change_gravity(const WorldState &state, Entities &entities, Rules &rules, Vec3 gravity);
// Why the watch does not check the body; empty if it does.
const char *unwatched(const World &w, const Body &b);
// Whether its energy counts in the largest one.
bool has_balance(const Body &b);
// Called after predict. False: a body, or the contact of a pair, has gained too much; the message says which.
bool watch_energy(World &w, StepContext &step, uint32_t *trouble);
// The gain of a body that backward Euler moves, or that steps itself, when the end of the sub-step is known:
// the energy that it gains beyond the work of contact, weight and loads, over its kinetic and elastic energy
// at the start or the end, whichever is more. 0 where it is not known.
double gain_at_end(const World &w, const StepContext &step, const Body &b);
// Called before commit: books what this sub-step puts into the bodies.
void book_energy(World &w, StepContext &step, double motion);
// Called if the host changes the body: the next check takes a new base.
void forget_energy(Body &b);
// The same if the host changes the shape of the body. If its model gives no energy, that of the new shape is
// unknown, and the body is not watched any more.
void lose_energy(Body &b);
void forget_energy(World &w);

// External work on a body whose model has changed: the decrease of its energy beyond that work is its own
// loss, which compensates the energy added by changes (world/change_energy.h).
double moving_energy(const Body &b);  // J, kinetic energy of the free components
// Before the commit: forces at the end, where the work at driven points follows from them.
void ready_change_work(Body &b, const SubStep &now);
// After it: forces times the way that their points went.
void book_change_work(const World &w, Body &b, double h);

}  // namespace dfm
