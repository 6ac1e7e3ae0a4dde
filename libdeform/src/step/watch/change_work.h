// External work on a body whose model has changed: the decrease of its energy beyond that work is its own
// loss, which compensates the energy added by changes (world/change_energy.h).
#pragma once
#include "dynamics/dynamics.h"

namespace dfm {

struct Body;
struct World;

double moving_energy(const Body &b);  // J, kinetic energy of the free components
// Before the commit: forces at the end, where the work at driven points follows from them.
void ready_change_work(Body &b, const SubStep &now);
// After it: forces times the way that their points went.
void book_change_work(const World &w, Body &b, double h);

}  // namespace dfm
