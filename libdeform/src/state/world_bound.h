// The bound of the step that a world keeps; step/step_bound.h asks for it.
#pragma once
#include <cstdint>

#include "geometry/surface.h"

namespace dfm {

struct Body;

// The step bound as it was last asked for.
struct WorldBound {
  double step = 0;        // s, 0.9 of the bound
  uint32_t age = kNone;   // sub-steps since the last look; kNone: ask before the next step
  uint32_t inverted = 0;  // cells inside out
  double strain = 0;      // that some edge may have had since then, until the next look included
  Body *body = nullptr;   // that bounds the step, by its
  uint32_t point = 0;
};

}  // namespace dfm
