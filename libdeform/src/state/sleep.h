// Sleep: an island at rest takes no part in sub-steps until something reaches it (doc/concepts/sleeping.md).
#pragma once
#include "math/vec3.h"

namespace dfm {

// The rest state of a body. While it sleeps, its positions, its contacts and the forces between it and others
// stay as they were at `since`.
struct Slumber {
  bool asleep = false;
  double calm = 0;   // s during which no point was fast or far from its anchor
  double since = 0;  // s, when it fell asleep
  double h = 0;      // s, the sub-step of its last contact impulses
  Vec3 force;        // N, of its contacts, while asleep
};

}  // namespace dfm
