// Sleeping: an island at rest is left out of the sub-steps until something reaches it
// (doc/concepts/sleeping.md).
#pragma once
#include "math/vec3.h"

namespace dfm {

// What a body remembers of its rest. Asleep, its positions, contacts and the forces between it and others
// stay as they were at `since`.
struct Slumber {
  bool asleep = false;
  double calm = 0;   // s so far in which no point was fast or went far from the anchor
  double since = 0;  // s, when it fell asleep
  double h = 0;      // s, the sub-step that its last contact impulses belong to
  Vec3 force;        // N, of its contacts, while asleep
};

}  // namespace dfm
