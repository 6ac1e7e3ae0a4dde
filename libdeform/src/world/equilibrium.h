// Equilibrium of a world under its loads.
#pragma once
#include "deform/world.h"

namespace dfm {

struct World;

// Throws Error where the world has what no equilibrium is looked for with.
void check_equilibrium(const World &w);
// Positions where every body is balanced, velocities zero, time gone on by def.time. Throws Error, and then
// nothing has changed.
void find_equilibrium(World &w, const dfm_equilibrium_def &def, dfm_equilibrium_info &info);

}  // namespace dfm
