// One sub-step of symplectic Euler for one point, as GLSL and as C++: spring_step.comp and springs.cpp define
// PLACE to DAMPING below. A point adds up the forces of its own springs, always in the same order, and writes
// itself alone, so neither the scheduling nor the device decides the sum. Force and motion of a spring:
//
//   f = (k (L - L0) / L + c v.d / L^2) d,   L - L0 = (L^2 - L0^2) / (L + L0)
//   v' = v + h (f / m + load - drag v),     x' = x + h v'
//
// Places, velocities and their sums are binary64: lengths squared are subtracted before they are rounded, so
// the body at rest is free of forces wherever it is, and a spring pulls along its own line, which keeps the
// angular momentum. The factor before d is binary32; a spring computes the same one at both ends.
void move_point(uint i) {
  const dvec4 x = PLACE(i);     // m; 1/kg
  const dvec4 v = SPEED(i);     // m/s; held components, bits 1 x, 2 y, 4 z
  const dvec4 load = LOAD(i);   // m/s2; drag 1/s
  const uvec2 row = ROW(i);     // of its springs: the first, how many; 32 points side by side
  precise double fx = double(0.0f);
  precise double fy = fx;
  precise double fz = fx;
  for (uint n = 0u; n < row.y; ++n) {
    const uvec4 spring = SPRING(row.x + 32u * n);   // other end, k, L0^2
    const dvec4 y = PLACE(spring.x);
    precise double dx = y.x - x.x;
    precise double dy = y.y - x.y;
    precise double dz = y.z - x.z;
    precise double square = (dx * dx + dy * dy) + dz * dz;
    precise double rest = packDouble2x32(uvec2(spring.z, spring.w));
    precise float k = uintBitsToFloat(spring.y);
    precise float now = float(square);
    precise float both = now + sqrt(now * float(rest));   // L (L + L0)
    precise float factor = k * (float(square - rest) / both);
    if (DAMPING > 0.0f) {
      const dvec4 w = SPEED(spring.x);
      precise double rate = ((w.x - v.x) * dx + (w.y - v.y) * dy) + (w.z - v.z) * dz;
      factor += (DAMPING * k) * (float(rate) / now);
    }
    // two points at one place: no direction, no force
    precise double scale = now > 1e-20f ? double(factor) : double(0.0f);
    fx += scale * dx;
    fy += scale * dy;
    fz += scale * dz;
  }
  const uint held = uint(v.w);
  precise double vx = v.x + STEP * ((fx * x.w + load.x) - load.w * v.x);
  precise double vy = v.y + STEP * ((fy * x.w + load.y) - load.w * v.y);
  precise double vz = v.z + STEP * ((fz * x.w + load.z) - load.w * v.z);
  vx = (held & 1u) != 0u ? v.x : vx;
  vy = (held & 2u) != 0u ? v.y : vy;
  vz = (held & 4u) != 0u ? v.z : vz;
  precise double nx = x.x + STEP * vx;
  precise double ny = x.y + STEP * vy;
  precise double nz = x.z + STEP * vz;
  NEXT_PLACE(i, dvec4(nx, ny, nz, x.w));
  NEXT_SPEED(i, dvec4(vx, vy, vz, v.w));
}
