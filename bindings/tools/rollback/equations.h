// The equations of Zerbato (2010, sections 4.2 and 5.4) for a colliding point, one by one, in a form that can
// be computed; each says how the printed form differs and why it cannot be computed. doc/concepts/rollback.md
// shows what they do to sliding, momentum and force.
#pragma once
#include <algorithm>

#include "math/vec3.h"

namespace dfm::rollback {

// (4.5): position of a vertex at the impact, x + t h v, with the time t of its island (printed: of the
// vertex). Position Verlet, Zerbato's integrator, then reads the velocity from positions, (x(t) - x(0)) / h:
// t times that of the full displacement. The text does not state it.
inline Vec3 velocity_after(Vec3 velocity, double t) { return t * velocity; }

// A safety factor on impact times; with it the next sub-step does not begin in the touch that
// this one ended in.
inline constexpr double kSafety = 0.9;

// (5.23), (5.24): normal force, N, >= 0. Printed as a choice between dot products of the forces of point and
// triangle in which the normal does not occur, and which is zero but where both are equally large.
// inverse_mass: n^T J M^-1 J^T n of the pair, 1/kg; speed: relative velocity along n at the end of a step of
// h under the forces of the last step, m/s.
inline double normal_force(double inverse_mass, double speed, double h) {
  return inverse_mass > 0 ? std::max(0.0, -speed / (inverse_mass * h)) : 0;
}

}  // namespace dfm::rollback
