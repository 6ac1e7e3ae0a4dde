// The end of a sub-step of symplectic Euler for a point on which f acts, as GLSL and as C++:
//   v' = v + h (f / m + load - drag v),     x' = x + h v',     u' = v' - kept (v' - u)
// u is the velocity that dampers with a lag see (doc/concepts/step.md, dampers).
void end_step(uint i, dvec4 x, dvec4 v, dvec4 load, double fx, double fy, double fz) {
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
  if (PER_LAG > 0.0f) {
    const dvec4 u = SEEN(i);
    precise double ux = vx - KEPT * (vx - u.x);
    precise double uy = vy - KEPT * (vy - u.y);
    precise double uz = vz - KEPT * (vz - u.z);
    NEXT_SEEN(i, dvec4(ux, uy, uz, u.w));
  }
}
