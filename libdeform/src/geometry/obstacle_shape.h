// An obstacle's shape in world coordinates: its axes, corners and signed distance. Computed once per obstacle
// and use, so that queries need no rotations.
#pragma once
#include <cstdint>

#include "geometry/views.h"
#include "math/vec3.h"

namespace dfm {

struct ObstaclePoint {
  Vec3 point;       // on the obstacle's surface
  Vec3 normal;      // unit, outward
  double distance;  // negative inside
  uint32_t face;    // box: the face of the normal, or the nearest one to it; else 0
};

class ObstacleShape {
 public:
  explicit ObstacleShape(const ObstacleView &view);
  const ObstacleView &view() const { return view_; }  // radius and half length 0 where the shape has none
  Vec3 axis(int k) const { return axis_[k]; }         // local x, y, z
  // sphere: the center, twice; capsule: centers of its caps
  Vec3 end(int k) const { return end_[k]; }
  // The shape is the hull of these points, widened by its radius: a box's corners, a capsule's ends, the
  // center of a sphere. A plane has none.
  uint32_t points() const;
  Vec3 point(uint32_t k) const { return view_.shape == Shape::box ? corner(k) : end_[k]; }

  // Box: corner i lies at + along axis k where bit k is set. Edges 4k..4k+3 run along axis k. Faces 2k
  // (toward -axis k), 2k+1 (toward +).
  Vec3 corner(uint32_t i) const;
  void edge(uint32_t i, Vec3 &from, Vec3 &to, uint32_t faces[2]) const;
  Vec3 face_normal(uint32_t i) const { return i & 1 ? axis_[i >> 1] : -axis_[i >> 1]; }

  ObstaclePoint closest(Vec3 p) const;  // not of a mesh
  // The second derivative of closest().distance along `way`, at the place whose closest point is o; not of
  // voxels, nor off an edge of a box.
  double bend(const ObstaclePoint &o, Vec3 way) const;
  Vec3 local(Vec3 p) const { return rotate_back(view_.rotation, p - view_.position); }
  // Voxels: may p, or a place near it, be nearer than `limit`? (VoxelGrid::near)
  bool voxels_near(Vec3 p, double limit) const;
  // Velocity of the shape at q, without the belt, and without the spin of a round shape about itself, which
  // does not move its surface.
  Vec3 shape_velocity(Vec3 q) const;
  // Largest distance from position of a point that rotation moves; 0 for a sphere; not for a plane, whose
  // extent the caller bounds.
  double extent() const;
  // Axis-parallel bounds; not for a plane or a mesh.
  void bounds(double lo[3], double hi[3]) const;

 private:
  ObstaclePoint closest_on_box(Vec3 p) const;
  ObstaclePoint closest_on_voxels(Vec3 p) const;
  ObstacleView view_;
  Vec3 axis_[3], end_[2];
};

}  // namespace dfm
