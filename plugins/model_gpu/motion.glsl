// The end of a sub-step of symplectic Euler for a point on which f acts, as GLSL and as C++:
//   v' = v + h (f / m + load - drag v),     x' = x + h v'
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
}
