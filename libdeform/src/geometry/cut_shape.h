// Shapes that cut: the tetrahedra that a moving shape meets, and the segments that it crosses.
//
//   ellipsoid, box   at a pose, swept along a straight way
//   blade            a quadrilateral: where an edge was, and where it is now
//   plane            through a whole body: a blade takes its place when it cuts (cut/planned_cut.h)
#pragma once
#include <cstdint>

#include "math/vec3.h"

namespace dfm {

enum class CutKind : uint32_t { ellipsoid = 0, box = 1, blade = 2, plane = 3 };

struct CutShape {
  CutKind kind = CutKind::ellipsoid;
  Vec3 position;  // m, of the start
  Quat rotation;
  Vec3 half_size;  // m: semi-axes, or half the edges of the box
  Vec3 way;        // m, in the axes of the world
  Vec3 corner[4];  // of the blade, m, in order around it, in the world; of a plane: a point, and its normal
};

// Corners in any order; one without volume counts as its hull. Touching counts as meeting.
bool meets_tetrahedron(const CutShape &shape, const Vec3 corner[4]);
// Whether the segment from a to b passes through the blade. An end on the blade counts as on the side to
// which the blade's normal points, so that consecutive segments cross it once.
bool crosses_blade(const CutShape &blade, Vec3 a, Vec3 b);

}  // namespace dfm
