// The step bound that a world keeps; step/step_bound.h computes it.
#pragma once
#include <cstdint>

#include "geometry/surface.h"

namespace dfm {

struct Body;

// The step bound as last computed.
struct WorldBound {
  double step = 0;        // s, 0.9 of the bound
  uint32_t age = kNone;   // sub-steps since it was computed; kNone: compute it before the next step
  uint32_t inverted = 0;  // inverted cells
  double strain = 0;      // largest possible strain of an edge from then until the next computation
  Body *body = nullptr;   // that bounds the step, by its
  uint32_t point = 0;
};

}  // namespace dfm
