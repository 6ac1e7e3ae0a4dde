// Poses of obstacles over a step.
#pragma once
#include "state/motion.h"

namespace dfm {

struct Obstacle;
struct StepContext;
struct World;

// At the end of the sub-step.
Pose end_pose(const World &w, const StepContext &step, const Obstacle &o);

// Writes into step.obstacle_views the velocity and spin that lead from the present pose to that at the end of
// the sub-step.
void view_obstacles(World &w, StepContext &step);
// Moves the obstacles to the end of the sub-step; `last`: last of the step, so that a target is met exactly.
void move_obstacles(World &w, const StepContext &step, bool last);
// The same if the guard allowed only a fraction of the displacement. Obstacles reach their poses in later
// sub-steps.
void move_obstacles_by(World &w, const StepContext &step, double fraction);

}  // namespace dfm
