// Warns of bodies that would fall on the back of an open mesh.
#pragma once
#include "state/world.h"

namespace dfm::scene {

// Warns once per obstacle. An open mesh acts on the side that its triangles face; a file whose triangles face
// the other way looks the same in a picture, and a body that falls on its back sticks to it.
void tell_back_side(dfm_context *context, const World &world, Vec3 gravity);

}  // namespace dfm::scene
