// Tells of bodies that what touches them presses flat: a heavy body on a soft one. Own weight alone is told
// when a body is made (world/rest_loads.h).
#pragma once

namespace dfm {

struct World;

// Called where the shapes are looked at (step/step_bound.h).
void tell_squeezed(World &w);

}  // namespace dfm
