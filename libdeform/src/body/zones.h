// Zones of a body's surface: triangles of one group and one material. They decide friction by group and by
// material.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "core/memory.h"
#include "geometry/surface.h"
#include "math/vec3.h"

namespace dfm {

inline constexpr double kDefaultFriction = 0.5;  // of a material that has no entry "friction"

struct SurfaceZones {
  struct Zone {
    std::string group, material;  // either may be empty
    double friction;              // coefficient of the material
  };
  std::vector<Zone> list;  // at least one, by first triangle
  Array<uint32_t> of;      // [ntri] index into list; empty: one zone everywhere
};

// The zone of a contact's feature. A triangle has its own. An edge and a surfel belong to the patch
// (geometry/surface.h) of their triangles that faces the other side most, `outward` being the unit normal
// toward it, and there to the lowest-numbered triangle: on the line between two zones of one face the choice
// then rests on numbers alone, never on rounding. type: ContactPoint::type_a.
uint32_t zone_of(const Surface &surface, const Array<uint32_t> &of, uint8_t type, uint32_t feature,
                 Vec3 outward);

}  // namespace dfm
