// First pass of a sub-step: forces of cells whose strain is measured in their own frames.
#include "cell.glsl"
#include "corner.glsl"
double grown(uint share, float stiffer, float damped) {
  const precise float k = uintBitsToFloat(share) * stiffer;
  const precise float c = uintBitsToFloat(share) * damped;
  return rows_of(k, c);
}
void force_of_cell(uint i) {
  const uvec4 q = CORNER(entry_of(i, 0u));
  const uvec4 to = CORNER(entry_of(i, 1u));
  const dvec4 g0 = SHAPE(entry_of(i, 0u));
  const dvec4 g1 = SHAPE(entry_of(i, 1u));
  const dvec4 g2 = SHAPE(entry_of(i, 2u));   // the last gradient, 2 mu V, lambda V
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
  edges_of(PLACE(q.x), PLACE(q.y), PLACE(q.z), PLACE(q.w), d);
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
    edges_of(OF_DAMPERS(q.x), OF_DAMPERS(q.y), OF_DAMPERS(q.z), OF_DAMPERS(q.w), d);
    precise double rate[9];
    gradient_of(d, g, rate);
    add_dampers(r, rate, e, damping * g2.y, damping * g2.z, all);
  }
  dvec4 grows = dvec4(0.0, 0.0, 0.0, 0.0);
  if (stiffer > 0.0f || damped > 0.0f) {
    const uvec4 share = CORNER(entry_of(i, 2u));
    grows = dvec4(grown(share.x, stiffer, damped), grown(share.y, stiffer, damped),
                  grown(share.z, stiffer, damped), grown(share.w, stiffer, damped));
  }
  precise double p[9];
  UNROLLED for (uint k = 0u; k < 9u; k += 3u)
    UNROLLED for (uint j = 0u; j < 3u; ++j)
      p[k + j] = (r[k] * all[j] + r[k + 1u] * all[3u + j]) + r[k + 2u] * all[6u + j];
  precise double of[9];
  UNROLLED for (uint k = 0u; k < 9u; k += 3u)
    UNROLLED for (uint j = 0u; j < 3u; ++j)
      of[k + j] = 0.0 - ((p[3u * j] * g[k] + p[3u * j + 1u] * g[k + 1u]) + p[3u * j + 2u] * g[k + 2u]);
  write_forces(to, of, grows);
}
