// Tearing of bodies where the strain exceeds the limit of the material (doc/concepts/cutting.md).
#pragma once
#include "state/body.h"

namespace dfm {

// At the end of a step: splits points of the world's bodies whose strain is above the limit. Throws Error;
// bodies before the one that fails have then been torn.
void tear_bodies(World &w);

}  // namespace dfm
