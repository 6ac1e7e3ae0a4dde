// First pass of a sub-step: each cell writes the forces of its corners where their points will read them, and
// with them what the cell adds to the rows of the step bound, of stiffness and of dampers, as two binary32.
// Corner 0 gets what the others leave, so their sum is zero.
#include "cell.glsl"
double rows_of(uint share, float stiffer, float damped) {
  const precise float k = uintBitsToFloat(share) * stiffer;
  const precise float c = uintBitsToFloat(share) * damped;
  return packDouble2x32(uvec2(floatBitsToUint(k), floatBitsToUint(c)));
}
void force_of_cell(uint i) {
  const uint at = i & 31u;   // 32 cells side by side
  const uint first = i - at;
  const uvec4 q = CORNER(3u * first + at);
  const uvec4 to = CORNER(3u * first + 32u + at);
  const dvec4 g0 = SHAPE(3u * first + at);
  const dvec4 g1 = SHAPE(3u * first + 32u + at);
  const dvec4 g2 = SHAPE(3u * first + 64u + at);   // the last gradient, 2 mu V, lambda V
  dvec4 x0 = PLACE(q.x);
  dvec4 x1 = PLACE(q.y);
  dvec4 x2 = PLACE(q.z);
  dvec4 x3 = PLACE(q.w);
  precise double g[9];
  g[0] = g0.x;
  g[1] = g0.y;
  g[2] = g0.z;
  g[3] = g0.w;
  g[4] = g1.x;
  g[5] = g1.y;
  g[6] = g1.z;
  g[7] = g1.w;
  g[8] = g2.x;
  precise double d[9];
  d[0] = x1.x - x0.x;
  d[1] = x1.y - x0.y;
  d[2] = x1.z - x0.z;
  d[3] = x2.x - x0.x;
  d[4] = x2.y - x0.y;
  d[5] = x2.z - x0.z;
  d[6] = x3.x - x0.x;
  d[7] = x3.y - x0.y;
  d[8] = x3.z - x0.z;
  precise double f[9];
  precise double r[9];
  precise double e[6];
  precise double s[6];
  precise double all[9];
  gradient_of(d, g, f);
  polar_of(f, r);
  strain_of(r, f, e);
  stress_of(e, g2.y, g2.z, s);
  all[0] = s[0];
  all[4] = s[1];
  all[8] = s[2];
  all[1] = s[3];
  all[3] = s[3];
  all[5] = s[4];
  all[7] = s[4];
  all[2] = s[5];
  all[6] = s[5];
  const dvec2 growth = growth_of(f, e, g2.y, g2.z);
  const precise float damper = DAMPING * float(growth.y);
  const precise float stiffer = float(growth.x) + PER_LAG * damper;
  const precise float damped = PER_LAG > 0.0f ? 0.0f : damper;
  if (DAMPING > 0.0f) {
    const double damping = double(DAMPING);
    x0 = OF_DAMPERS(q.x);
    x1 = OF_DAMPERS(q.y);
    x2 = OF_DAMPERS(q.z);
    x3 = OF_DAMPERS(q.w);
    d[0] = x1.x - x0.x;
    d[1] = x1.y - x0.y;
    d[2] = x1.z - x0.z;
    d[3] = x2.x - x0.x;
    d[4] = x2.y - x0.y;
    d[5] = x2.z - x0.z;
    d[6] = x3.x - x0.x;
    d[7] = x3.y - x0.y;
    d[8] = x3.z - x0.z;
    precise double rate[9];
    gradient_of(d, g, rate);
    add_dampers(r, rate, e, damping * g2.y, damping * g2.z, all);
  }
  dvec4 grows = dvec4(0.0, 0.0, 0.0, 0.0);
  if (stiffer > 0.0f || damped > 0.0f) {
    const uvec4 share = CORNER(3u * first + 64u + at);
    grows = dvec4(rows_of(share.x, stiffer, damped), rows_of(share.y, stiffer, damped),
                  rows_of(share.z, stiffer, damped), rows_of(share.w, stiffer, damped));
  }
  precise double p[9];
  UNROLLED for (uint k = 0u; k < 9u; k += 3u)
    UNROLLED for (uint j = 0u; j < 3u; ++j)
      p[k + j] = (r[k] * all[j] + r[k + 1u] * all[3u + j]) + r[k + 2u] * all[6u + j];
  precise double of[9];
  UNROLLED for (uint k = 0u; k < 9u; k += 3u)
    UNROLLED for (uint j = 0u; j < 3u; ++j)
      of[k + j] = 0.0 - ((p[3u * j] * g[k] + p[3u * j + 1u] * g[k + 1u]) + p[3u * j + 2u] * g[k + 2u]);
  precise double fx = 0.0 - ((of[0] + of[3]) + of[6]);
  precise double fy = 0.0 - ((of[1] + of[4]) + of[7]);
  precise double fz = 0.0 - ((of[2] + of[5]) + of[8]);
  FORCE(to.x, dvec4(fx, fy, fz, grows.x));
  FORCE(to.y, dvec4(of[0], of[1], of[2], grows.y));
  FORCE(to.z, dvec4(of[3], of[4], of[5], grows.z));
  FORCE(to.w, dvec4(of[6], of[7], of[8], grows.w));
}
