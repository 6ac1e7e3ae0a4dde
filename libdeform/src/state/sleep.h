// Sleep: an island at rest takes no part in sub-steps until something reaches it (doc/concepts/sleeping.md).
#pragma once
#include "core/memory.h"
#include "math/vec3.h"

namespace dfm {

// The rest state of a body. While it sleeps, its positions, its contacts and the forces between it and others
// stay as they were at `since`.
struct SleepState {
  bool asleep = false;
  double quiet_time = 0;  // s during which no point was fast or far from its anchor
  double since = 0;       // s, when it fell asleep
  double h = 0;           // s, the sub-step of its contact impulses, until it has new ones; else 0
  Vec3 force;             // N, of its contacts, while asleep
};

// What waking has changed within a sub-step: if that fails, the bodies sleep as before.
struct Roused {
  struct Was {
    uint32_t slot;
    SleepState sleep_state;
    Vec3 impulse;  // N s, of contacts since creation
  };
  Array<Was> bodies;
  Array<double> dwell;  // s, [contacts of the store]
  Array<Vec3> total;    // N s, [attachments]
};

}  // namespace dfm
