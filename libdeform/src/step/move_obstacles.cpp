#include "math/turn.h"
#include "step/move_obstacles.h"

#include "body/obstacle_mesh.h"
#include "state/obstacle.h"
#include "step/context.h"
#include "step/rigid/rigid.h"

namespace dfm {

Pose Obstacle::end_pose(double h, double left, double rest) const {
  if (rigid) return shape_pose(*this, rigid->next[rigid_body]);
  if (!has_target && !moves()) return pose;
  const Pose end = has_target ? target : pose_at_time(world->prescribed.at(world->time + rest));
  if (!has_target && !(h < rest)) return end;
  const double s = h / (has_target ? left : rest);
  return {pose.position + s * (end.position - pose.position),
          slerp(pose.rotation, end.rotation, s < 1 ? s : 1)};
}

Pose end_pose(const World &w, const StepContext &step, const Obstacle &o) {
  return o.end_pose(step.h, step.left, step.rest);
}

void view_obstacles(World &w, StepContext &step) {
  const double h = step.h, left = step.left;
  for (size_t i = 0; i < w.obstacles.size(); ++i) {
    const Obstacle &o = *w.obstacles[i];
    ObstacleView &v = step.obstacle_views[i];
    v.position = o.pose.position;
    v.rotation = o.pose.rotation;
    v.velocity = v.spin = v.linear = {};
    if (o.has_target) {
      v.velocity = (1 / left) * (o.target.position - o.pose.position);
      v.spin = spin_between(o.pose.rotation, o.target.rotation, left);
    } else if (o.moves()) {
      const Pose end = end_pose(w, step, o);
      v.velocity = (1 / h) * (end.position - o.pose.position);
      v.spin = spin_between(o.pose.rotation, end.rotation, h);
    }
    if (o.mesh) o.mesh->place(v.position, v.rotation, v.velocity, v.spin);
  }
}

void move_obstacles(World &w, const StepContext &step, bool last) {
  for (auto &o : w.obstacles) {
    if (o->has_target || o->moves()) o->pose = last && o->has_target ? o->target : end_pose(w, step, *o);
    if (last) o->has_target = false;
  }
}

void move_obstacles_by(World &w, const StepContext &step, double fraction) {
  for (auto &o : w.obstacles) {
    if (!o->has_target && !o->moves()) continue;
    const Pose end = end_pose(w, step, *o);
    o->pose = {o->pose.position + fraction * (end.position - o->pose.position),
               slerp(o->pose.rotation, end.rotation, fraction)};
  }
}

}  // namespace dfm
