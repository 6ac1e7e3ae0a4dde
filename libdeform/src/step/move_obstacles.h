// Poses of obstacles over a step.
#pragma once

namespace dfm {

struct StepContext;
struct World;

// Pose now and at the end of the sub-step, as the velocity and spin that lead from one to the other, into
// step.obstacle_views.
void view_obstacles(World &w, StepContext &step);
// Where the obstacles are at the end of the sub-step; `last`: of the step, so that a target is met exactly.
void move_obstacles(World &w, const StepContext &step, bool last);
// Where the guard let the bodies go a fraction of their way only. Obstacles come to their poses in the
// sub-steps after.
void move_obstacles_by(World &w, const StepContext &step, double fraction);

}  // namespace dfm
