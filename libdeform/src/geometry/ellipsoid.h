// An ellipsoid as a closed mesh: an icosahedron whose triangles are cut in four, points put on the surface.
#pragma once
#include <cstdint>
#include <vector>

#include "math/vec3.h"

namespace dfm {

struct EllipsoidMesh {
  std::vector<double> points;       // [n,3] m
  std::vector<uint32_t> triangles;  // [20 * 4^refinements, 3] counter-clockwise from outside
};
EllipsoidMesh ellipsoid_mesh(Vec3 half_axes, uint32_t refinements);

}  // namespace dfm
