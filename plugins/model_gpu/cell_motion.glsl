// Second pass of a sub-step of cells: each point takes the forces of its corners, and moves.
#include "motion.glsl"
#include "corners.glsl"
void move_corners(uint i) {
  const dvec4 x = PLACE(i);
  const dvec4 v = SPEED(i);
  const dvec4 load = LOAD(i);
  precise double f[3];
  f[0] = 0.0;
  f[1] = 0.0;
  f[2] = 0.0;
  add_corners(i, x, v, load, f);
  end_step(i, x, v, load, f[0], f[1], f[2]);
}
