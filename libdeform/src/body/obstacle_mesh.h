// A triangle mesh with prescribed motion: a Surface whose positions and velocities come from a pose and whose
// nodes have no degrees of freedom, so that detection treats it like the surface of a body.
#pragma once
#include <cstdint>

#include "core/memory.h"
#include "geometry/surface.h"
#include "math/vec3.h"

namespace dfm {

struct ObstacleMesh {
  // x and v: world frame, as last placed. Features that can never touch first are owned by no triangle
  Surface surface;
  Array<double> local;  // [nsurfel,3] m, in the obstacle's frame
  double extent = 0;    // m, farthest point from the frame's origin
  bool closed = false;  // every edge has two consistently oriented triangles
  Vec3 position;        // of the last place()
  Quat rotation;
  bool moving = false;  // v is not zero

  // points [npoint,3], tris [ntri,3] counter-clockwise seen from outside.
  ObstacleMesh(const Memory &memory, uint32_t npoint, const double *points, uint32_t ntri,
               const uint32_t *tris);
  // Sets the pose at the start of a sub-step and the rates over it. Costs nothing without motion.
  void place(Vec3 position, Quat rotation, Vec3 velocity, Vec3 spin);
};

}  // namespace dfm
