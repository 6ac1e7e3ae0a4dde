// Second pass of a sub-step, as GLSL and as C++: a point adds up the forces of its corners, always in the
// same order. The highest rate of all is that of the step bound at this shape: 1 / h with h^2 D/m + 2 h E/m =
// 4; dampers with a lag count in D, over the lag.
void add_corners(uint i, dvec4 x, dvec4 v, dvec4 load, OUT(f, 3)) {
  const uvec2 row = CORNER_ROW(i);
  precise float stiffer = 0.0f;
  precise float damped = 0.0f;
  // four at a time; behind a point's last corner lie others', which are read and not used
  for (uint n = 0u; n < row.y; n += 4u) {
    dvec4 c[4];
    UNROLLED for (uint k = 0u; k < 4u; ++k) c[k] = CORNER_FORCE(row.x + 32u * (n + k));
    UNROLLED for (uint k = 0u; k < 4u; ++k) {
      if (n + k < row.y) {
        f[0] += c[k].x;
        f[1] += c[k].y;
        f[2] += c[k].z;
        const uvec2 more = unpackDouble2x32(c[k].w);
        stiffer += uintBitsToFloat(more.x);
        damped += uintBitsToFloat(more.y);
      }
    }
  }
  precise double rest = REST_ROW(i);   // 1/s2, D/m
  precise double of_dampers = double(DAMPING) * rest;
  precise double stiff = (rest + double(PER_LAG) * of_dampers) + x.w * double(stiffer);
  precise double damper = ((PER_LAG > 0.0f ? double(0.0f) : of_dampers) + load.w) + x.w * double(damped);
  precise double rate = 0.25 * (damper + sqrt(damper * damper + 4.0 * stiff));
  if (uint(v.w) != 7u) RAISE(float(rate));   // a held point does not move
}
