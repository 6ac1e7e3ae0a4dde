// Shapes that cut: which tetrahedra one meets on its way, and which segments it crosses.
//
//   ellipsoid, box   at a pose, swept along a straight way
//   blade            a quadrilateral: where an edge was, and where it is now
#pragma once
#include <cstdint>

#include "math/vec3.h"

namespace dfm {

enum class CutKind : uint32_t { ellipsoid = 0, box = 1, blade = 2 };

struct CutShape {
  CutKind kind = CutKind::ellipsoid;
  Vec3 position;  // m, of the start
  Quat rotation;
  Vec3 half_size;  // m: semi-axes, or half the edges of the box
  Vec3 way;        // m, in the axes of the world
  Vec3 corner[4];  // of the blade, m, in order around it, in the world
};

// Corners in any order; one without volume counts as its hull. Touching counts as meeting.
bool meets_tetrahedron(const CutShape &shape, const Vec3 corner[4]);
// Does the segment from a to b go through the blade? An end on it counts as lying on the side that the
// blade's normal points to, so that segments which go on from each other cross it once.
bool crosses_blade(const CutShape &blade, Vec3 a, Vec3 b);

}  // namespace dfm
