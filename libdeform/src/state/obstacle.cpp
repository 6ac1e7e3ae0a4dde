#include "state/obstacle.h"

#include "body/obstacle_mesh.h"
#include "geometry/obstacle_shape.h"
#include "geometry/voxel_grid.h"
#include "state/search_tree.h"

namespace dfm {

Obstacle::Obstacle() = default;
Obstacle::~Obstacle() = default;

Pose Obstacle::pose_at_time(double t) const {
  Pose p = keys.empty() ? to_pose(def.pose) : pose_at(keys, t);
  if (def.sine.frequency != 0 || def.sine.phase != 0)
    p.position += sine_at(def.sine, t) * load3(def.sine.amplitude);
  return p;
}

ObstacleView Obstacle::view() const {
  ObstacleView v{};
  v.shape = Shape(def.shape);
  v.position = pose.position;
  v.rotation = pose.rotation;
  v.half_size = load3(def.half_size);
  v.radius = def.radius;
  v.half_length = def.half_length;
  v.extent = mesh ? mesh->extent : grid ? grid->extent() : 0;
  return v;
}

}  // namespace dfm
