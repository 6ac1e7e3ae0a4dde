// A triangle mesh with prescribed motion: a Surface whose positions and velocities come from a pose and whose
// nodes have no degrees of freedom, so that detection treats it like the surface of a body.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "core/memory.h"
#include "geometry/box_tree.h"
#include "geometry/surface.h"
#include "math/extent.h"
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

  // For what searches the mesh in every sub-step (step/rigid/tool_shape.h). A tree in the obstacle's frame
  // holds for all poses, so a mesh that moves costs no refit.
  std::unique_ptr<const BoxTree> tree;  // null: triangles_near() gives them all
  void make_tree(const Memory &memory);
  // All triangles whose own boxes in the world overlap this one, and some beside them, ascending. Boxes are
  // parallel to the axes of the world. Returns how many boxes of the tree it has looked at.
  uint64_t triangles_near(Vec3 lo, Vec3 hi, std::vector<uint32_t> &out) const;
  // The axis-parallel bounds of x; computed once in each place.
  const Extent &bounds();

 private:
  Extent bounds_;
  bool bounded_ = false;  // bounds_ are those of x
};

}  // namespace dfm
