// Second pass: each point adds up the forces of its corners, always in the same order, and moves. Where the
// step is longer than the bound at this shape, it says so: h^2 D/m + 2 h E/m above 4.
#include "motion.glsl"
void move_corners(uint i) {
  const dvec4 x = PLACE(i);
  const dvec4 v = SPEED(i);
  const dvec4 load = LOAD(i);
  const uvec2 row = ROW(i);
  precise double fx = 0.0;
  precise double fy = 0.0;
  precise double fz = 0.0;
  precise double grows = 0.0;
  // four at a time; behind a point's last corner lie others', which are read and not used
  for (uint n = 0u; n < row.y; n += 4u) {
    dvec4 f[4];
    UNROLLED for (uint k = 0u; k < 4u; ++k) f[k] = CORNER_FORCE(row.x + 32u * (n + k));
    UNROLLED for (uint k = 0u; k < 4u; ++k) {
      if (n + k < row.y) {
        fx += f[k].x;
        fy += f[k].y;
        fz += f[k].z;
        grows += f[k].w;
      }
    }
  }
  precise double rest = REST_ROW(i);   // 1/s2, D/m
  precise double most =
      STEP * (STEP * rest + 2.0 * (double(DAMPING) * rest + load.w)) + x.w * grows;
  if (most > 4.0) EXCEEDS(float(most));
  end_step(i, x, v, load, fx, fy, fz);
}
