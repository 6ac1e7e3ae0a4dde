// What rigid things do to each other, for reports: the contacts of the last sub-step, and the pairs that
// touch (step/rigid/tool_report.cpp).
#pragma once
#include <compare>
#include <cstdint>

#include "core/memory.h"
#include "math/vec3.h"

namespace dfm {

// A place that carries load. Side a is the one that gives way; where both do, the one that was made first.
struct RigidContact {
  uint64_t key;
  uint64_t a, b;         // ids
  Vec3 point;            // m
  Vec3 normal, tangent;  // from b to a
  double impulse[3];     // N s on a: along normal, tangent, normal x tangent
  double slip[2];        // m/s, of a relative to b
  double bristle[2];     // m
  double gap;            // m, distance less d_c
  uint32_t law;
  uint32_t sticks, began;  // flags

  Vec3 force() const {  // N s
    return impulse[0] * normal + impulse[1] * tangent + impulse[2] * cross(normal, tangent);
  }
};

struct RigidPair {
  uint64_t a, b;  // ids, as above
  auto operator<=>(const RigidPair &) const = default;
};

struct RigidReport {
  double h = 0;  // s, of that sub-step
  Array<RigidContact> contacts;
  Array<RigidPair> touching;  // ascending

  explicit RigidReport(const Memory &memory) { use_memory(memory, contacts, touching); }
};

}  // namespace dfm
