// Equilibrium of a world whose bodies may touch: steps from rest until nothing changes any more.
#pragma once
#include "deform/world.h"

namespace dfm {

struct World;

// As find_equilibrium(), with contact and friction; the world is prepared. Throws Error, and then nothing has
// changed.
void settle(World &w, const dfm_equilibrium_def &def, dfm_equilibrium_info &info);

}  // namespace dfm
