// Equilibrium of a world with contact: steps from rest until nothing changes.
#pragma once
#include "deform/world.h"

namespace dfm {

struct World;

// As find_equilibrium(), with contact and friction; the world is prepared. Throws Error; then nothing has
// changed.
void settle(World &w, const dfm_equilibrium_def &def, dfm_equilibrium_info &info);

}  // namespace dfm
