// What of a world takes how much memory (dfm_world_memory). What a part allocates goes through its meter.
#pragma once
#include "core/memory.h"

namespace dfm {

struct Meters {
  Meter bodies;     // points, cells, surfaces, couplings, what models keep for each body
  Meter dynamics;   // how bodies move: matrices and factors of implicit ones
  Meter obstacles;  // surfaces, voxels
  Meter detection;  // trees, lists of pairs
  Meter contacts;   // rows, laws' states, what lasts of contacts, reports
  Meter steps;      // other buffers of a step
  explicit Meters(const Memory &m)
      : bodies(m), dynamics(m), obstacles(m), detection(m), contacts(m), steps(m) {}
};

}  // namespace dfm
