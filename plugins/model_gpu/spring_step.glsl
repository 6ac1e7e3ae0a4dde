// One sub-step of one point, as GLSL and as C++: spring_step.comp and as_cpp.h define what is in capitals
// below. A point adds up the forces of its own springs, always in the same order, then those of its cells
// where these resist a change of volume, and writes itself alone, so neither the scheduling nor the device
// decides the sum. Force of a spring:
//
//   f = (k (L - L0) / L + c u.d / L^2) d,   L - L0 = (L^2 - L0^2) / (L + L0)
//
// Places, velocities and their sums are binary64: lengths squared are subtracted before they are rounded, so
// the body at rest is free of forces wherever it is, and a spring pulls along its own line, which keeps the
// angular momentum. The factor before d is binary32; a spring computes the same one at both ends. With a
// branch, whose stretch is p = r + WAS e, it is k ((1 - PART) e + PART p) / L, e = L - L0; r is kept at both
// ends, with the same bits. A tilted spring that is TURNED (form A) pulls L / |d| times as strongly.
#include "motion.glsl"
#include "corners.glsl"
// The root of binary32 and a step of Newton's method from there.
double root_of(double square) {
  const precise float near = sqrt(float(square));
  precise double first = double(near);
  precise double missing = square - first * first;
  precise double root = first + double(float(missing) * (0.5f / near));
  return near > 0.0f ? root : first;
}
void move_point(uint i) {
  const dvec4 x = PLACE(i);     // m; 1/kg
  const dvec4 v = SPEED(i);     // m/s; held components, bits 1 x, 2 y, 4 z
  const dvec4 load = LOAD(i);   // m/s2; drag 1/s
  const dvec4 u = DAMPING > 0.0f ? OF_DAMPERS(i) : v;
  const uvec2 row = SPRING_ROW(i);   // the first of its springs, how many; 32 points side by side
  precise double f[3];
  f[0] = double(0.0f);
  f[1] = f[0];
  f[2] = f[0];
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
      const uint at = row.x + 32u * (n + k);
      precise double dx = y[k].x - x.x;
      precise double dy = y[k].y - x.y;
      precise double dz = y[k].z - x.z;
      precise double square = (dx * dx + dy * dy) + dz * dz;
      precise double rest = packDouble2x32(uvec2(spring[k].z, spring[k].w));
      precise float stiffness = uintBitsToFloat(spring[k].y);
      precise float damper = DAMPING * stiffness;
      const precise float plain = float(square);
      precise float now = plain;
      precise float before = float(rest);
      precise float tilt = 0.0f;
      if (HAS_OPTIONS) {   // w^2, share of DAMPING
        const uvec2 more = OPTIONS(at);
        tilt = uintBitsToFloat(more.x);
        now = now + tilt;
        before = before + tilt;
        damper = damper * uintBitsToFloat(more.y);
      }
      precise float stretch = float(square - rest) / (now + sqrt(now * before));   // L (L + L0)
      if (HAS_BRANCHES) {
        if (n + k < row.y) {
          precise double length = root_of(square + double(tilt));
          precise double e = length - root_of(rest + double(tilt));
          precise double p = STRETCH(at) + WAS * e;
          precise double r = KEEP * p - NEXT * e;
          stretch = float((1.0 - PART) * e + PART * p) / float(length);
          NEXT_STRETCH(at, r);
        }
      }
      precise double rate = ((w[k].x - u.x) * dx + (w[k].y - u.y) * dy) + (w[k].z - u.z) * dz;
      precise float factor = stiffness * stretch + damper * (float(rate) / now);
      if (TURNED) factor = factor * sqrt(now / plain);
      if (n + k < row.y && plain > 1e-20f) {   // two points at one place: no direction, no force
        precise double scale = double(factor);
        f[0] += scale * dx;
        f[1] += scale * dy;
        f[2] += scale * dz;
      }
    }
  }
  if (HAS_CELLS) add_corners(i, x, v, load, f);
  end_step(i, x, v, load, f[0], f[1], f[2]);
}
