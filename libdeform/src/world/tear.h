// Bodies that tear where their material is stretched beyond what it bears (doc/concepts/cutting.md).
#pragma once
#include "state/body.h"

namespace dfm {

// Does a material of its cells have "tear"?
bool may_tear(const Body &b);
// At the end of a step: splits points of the world's bodies that are stretched too far. Throws Error; bodies
// before the one that fails have torn then.
void tear_bodies(World &w);

}  // namespace dfm
