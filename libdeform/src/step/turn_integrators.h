// What ends a step because bodies have the wrong one of the two integrators that are left to the library
// (step/counting.h): it is taken again with the other one, from the state before it.
#pragma once

namespace dfm {

struct World;

// Implicit steps cost too much: explicit ones from now on. time: s of explicit time whose work has been done
// for a step that was given up.
void give_up_implicit(World &w, double time);
// Explicit time would take more sub-steps than a step may have: implicit steps, whatever this one costs.
void take_up_implicit(World &w);
// Whether the latter has anybody to move.
bool may_take_up_implicit(const World &w);
// Ends the present step for that reason.
[[noreturn]] void end_explicit_step();

}  // namespace dfm
