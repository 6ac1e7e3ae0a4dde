// Contact impulses of pairs over the whole last step; step/step_impulses.h sums them.
#pragma once
#include "core/memory.h"
#include "math/vec3.h"

namespace dfm {

struct StepImpulses {
  static constexpr int kParts = 8;
  struct Pair {
    uint64_t a, b;                   // ids; between two bodies a is the lower one
    Vec3 impulse;                    // N s, on a
    Vec3 place;                      // m N s: points of contact, weighted with their normal impulses
    double normal;                   // N s, sum of normal impulses
    double touching;                 // s with a nonzero impulse
    double peak_normal, peak_force;  // N, means over the sub-step where they were largest
    double part[kParts];             // N s, `normal` by equal parts of the step
    Vec3 now;                        // N s, of the present sub-step
    double now_normal;
  };
  Array<Pair> pairs;             // sorted by (a, b)
  double start = 0, length = 0;  // s, of the step
  double idle = 0;               // s of this step in which all bodies slept: forces are those of the store
};

}  // namespace dfm
