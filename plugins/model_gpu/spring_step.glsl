// One sub-step of one point, as GLSL and as C++: spring_step.comp and springs.cpp define PLACE to DAMPING
// below. A point adds up the forces of its own springs, always in the same order, and writes itself alone, so
// neither the scheduling nor the device decides the sum. Force of a spring:
//
//   f = (k (L - L0) / L + c u.d / L^2) d,   L - L0 = (L^2 - L0^2) / (L + L0)
//
// Places, velocities and their sums are binary64: lengths squared are subtracted before they are rounded, so
// the body at rest is free of forces wherever it is, and a spring pulls along its own line, which keeps the
// angular momentum. The factor before d is binary32; a spring computes the same one at both ends.
#include "motion.glsl"
void move_point(uint i) {
  const dvec4 x = PLACE(i);     // m; 1/kg
  const dvec4 v = SPEED(i);     // m/s; held components, bits 1 x, 2 y, 4 z
  const dvec4 load = LOAD(i);   // m/s2; drag 1/s
  const dvec4 u = DAMPING > 0.0f ? OF_DAMPERS(i) : v;
  const uvec2 row = ROW(i);     // of its springs: the first, how many; 32 points side by side
  precise double fx = double(0.0f);
  precise double fy = fx;
  precise double fz = fx;
  // Four at a time, so that a device waits once for four springs and once for their other ends. Behind a
  // point's last spring lie others', which are read and not used.
  for (uint n = 0u; n < row.y; n += 4u) {
    uvec4 spring[4];   // other end, k, L0^2
    dvec4 y[4];
    dvec4 w[4];
    UNROLLED for (uint k = 0u; k < 4u; ++k) spring[k] = SPRING(row.x + 32u * (n + k));
    UNROLLED for (uint k = 0u; k < 4u; ++k) y[k] = PLACE(spring[k].x);
    UNROLLED for (uint k = 0u; k < 4u; ++k) w[k] = DAMPING > 0.0f ? OF_DAMPERS(spring[k].x) : v;
    UNROLLED for (uint k = 0u; k < 4u; ++k) {
      precise double dx = y[k].x - x.x;
      precise double dy = y[k].y - x.y;
      precise double dz = y[k].z - x.z;
      precise double square = (dx * dx + dy * dy) + dz * dz;
      precise double rest = packDouble2x32(uvec2(spring[k].z, spring[k].w));
      precise float stiffness = uintBitsToFloat(spring[k].y);
      precise float now = float(square);
      precise float both = now + sqrt(now * float(rest));   // L (L + L0)
      precise double rate = ((w[k].x - u.x) * dx + (w[k].y - u.y) * dy) + (w[k].z - u.z) * dz;
      precise float factor =
          stiffness * (float(square - rest) / both) + (DAMPING * stiffness) * (float(rate) / now);
      if (n + k < row.y && now > 1e-20f) {   // two points at one place: no direction, no force
        precise double scale = double(factor);
        fx += scale * dx;
        fy += scale * dy;
        fz += scale * dz;
      }
    }
  }
  end_step(i, x, v, load, fx, fy, fz);
}
