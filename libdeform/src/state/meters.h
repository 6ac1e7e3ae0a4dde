// Memory of the parts of a world (dfm_world_memory). Each part allocates through its meter.
#pragma once
#include "core/memory.h"

namespace dfm {

struct Meters {
  Meter bodies;     // points, cells, surfaces, couplings, data of models for each body
  Meter dynamics;   // dynamics of bodies: matrices and factors of implicit ones
  Meter obstacles;  // surfaces, voxels
  Meter detection;  // trees, lists of pairs
  Meter contacts;   // rows, states of laws, lasting contacts, reports
  Meter steps;      // other buffers of a step
  explicit Meters(const Memory &m)
      : bodies(m), dynamics(m), obstacles(m), detection(m), contacts(m), steps(m) {}
};

}  // namespace dfm
