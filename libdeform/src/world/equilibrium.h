// Equilibrium of a world under its loads.
#pragma once
#include "deform/world.h"

namespace dfm {

struct World;

// Throws Error if the world has something for which no equilibrium can be computed.
void check_equilibrium(const World &w);
// Sets positions at which every body is in equilibrium, zero velocities, and advances time by def.time.
// Throws Error; then nothing has changed.
void find_equilibrium(World &w, const dfm_equilibrium_def &def, dfm_equilibrium_info &info);

}  // namespace dfm
