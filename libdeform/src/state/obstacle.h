// A rigid shape that bodies touch: prescribed, or one of a host's rigid bodies.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "body/zones.h"
#include "deform/deform.h"
#include "geometry/obstacle_shape.h"
#include "state/motion.h"

namespace dfm {

struct ObstacleMesh;
struct RigidSet;
class SearchTree;
class VoxelGrid;
struct World;

// What lasts of an obstacle. Snapshots have it, and some members of its def.
struct ObstacleState {
  std::string material;
  SurfaceZones::Zone zone{"", "", kDefaultFriction};
  std::vector<dfm_pose_key> keys;
  Pose pose;    // now
  Pose target;  // at the end of the next step, if move_to was called
  bool has_target = false;
};

struct Obstacle : ObstacleState {
  static constexpr char kKind[] = "obstacle";
  World *world = nullptr;
  uint64_t id = 0, handle = 0;
  uint32_t slot = 0;
  std::string name;
  dfm_obstacle_def def{};
  bool sensor = false;        // reports what overlaps it, and pushes nothing
  RigidSet *rigid = nullptr;  // if it is a body of a rigid host: its index in `rigid`
  uint32_t rigid_body = 0;
  bool added = false;  // an additional shape of that body, at `local` in its frame
  Pose local;
  bool moves() const {
    return !keys.empty() || def.sine.amplitude[0] != 0 || def.sine.amplitude[1] != 0 ||
           def.sine.amplitude[2] != 0;
  }
  Array<double> points;  // mesh, voxels: as given, in its frame
  Array<uint32_t> triangles;
  std::unique_ptr<ObstacleMesh> mesh;
  std::unique_ptr<VoxelGrid> grid;
  std::unique_ptr<SearchTree> search;  // rays

  Obstacle();
  ~Obstacle();
  Pose pose_at_time(double t) const;
  // Shape and size, where it is now; of a mesh and voxels the extent alone.
  ObstacleView view() const;
  ObstacleShape standing() const { return ObstacleShape(view()); }
  // Where it is at the end of a sub-step, in a step whose remaining time is `left`. rest: s, to the end of
  // the planned sub-step, of which this is a piece if h is less. The obstacle goes straight to where it has
  // to be then: what it was held back earlier, it catches up in that time and not in the first piece.
  Pose end_pose(double h, double left, double rest) const;
};

}  // namespace dfm
