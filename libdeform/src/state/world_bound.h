// The bound of the step that a world keeps; step/step_bound.h asks for it.
#pragma once
#include <cstdint>

#include "geometry/surface.h"

namespace dfm {

struct Body;

// The step bound as it was last asked for.
struct WorldBound {
  double step = 0;        // s, 0.9 of the bound
  uint32_t age = kNone;   // sub-steps since then; kNone: ask before the next step
  uint32_t inverted = 0;  // cells inside out
  Body *body = nullptr;   // that bounds the step, by its
  uint32_t point = 0;
};

}  // namespace dfm
