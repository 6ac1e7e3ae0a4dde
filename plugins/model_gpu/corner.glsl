// First pass of a sub-step, as GLSL and as C++: what cells of either model do. Each cell writes the forces of
// its corners where their points will read them, and with them what the cell adds to the rows of the step
// bound, of stiffness and of dampers, as two binary32.
uint entry_of(uint cell, uint part) {   // 32 cells side by side
  const uint at = cell & 31u;
  return 3u * (cell - at) + 32u * part + at;
}
// Edges from corner 0 to the others.
void edges_of(dvec4 x0, dvec4 x1, dvec4 x2, dvec4 x3, OUT(d, 9)) {
  d[0] = x1.x - x0.x;
  d[1] = x1.y - x0.y;
  d[2] = x1.z - x0.z;
  d[3] = x2.x - x0.x;
  d[4] = x2.y - x0.y;
  d[5] = x2.z - x0.z;
  d[6] = x3.x - x0.x;
  d[7] = x3.y - x0.y;
  d[8] = x3.z - x0.z;
}
double rows_of(float stiffer, float damped) {
  return packDouble2x32(uvec2(floatBitsToUint(stiffer), floatBitsToUint(damped)));
}
// of: forces of corners 1 to 3. Corner 0 gets what the others leave, so their sum is zero.
void write_forces(uvec4 to, IN(of, 9), dvec4 rows) {
  precise double fx = 0.0 - ((of[0] + of[3]) + of[6]);
  precise double fy = 0.0 - ((of[1] + of[4]) + of[7]);
  precise double fz = 0.0 - ((of[2] + of[5]) + of[8]);
  FORCE(to.x, dvec4(fx, fy, fz, rows.x));
  FORCE(to.y, dvec4(of[0], of[1], of[2], rows.y));
  FORCE(to.z, dvec4(of[3], of[4], of[5], rows.z));
  FORCE(to.w, dvec4(of[6], of[7], of[8], rows.w));
}
