// The ops on the blocks. Forces run in two passes: each block loads its points, sums its springs and cells into its own array,
// halo included; then each block adds up, in block order, what the others' halos hold for its points. No two workers write
// one place, and the order of every sum is fixed by the mesh.
#include "msm_body.h"

#include <stdlib.h>

namespace msm {
namespace {

struct Call {
  Body *body;
  const dfm_kin *k;
  double *f;
};

void force_pass(void *user, uint32_t begin, uint32_t end) {
  const Call &call = *static_cast<const Call *>(user);
  Body &body = *call.body;
  const double damp = body.params[kDampingStiffness];
  for (uint32_t n = begin; n < end; ++n) {
    const Block &b = body.block[n];
    body.kernels->load(b, call.k->x, damp > 0 ? call.k->v : nullptr, call.k->stride);
    if (damp > 0) body.kernels->damped_springs(b, damp);
    else body.kernels->springs(b);
    if (body.has_volume()) body.kernels->cells(b);
  }
}

void merge_pass(void *user, uint32_t begin, uint32_t end) {
  const Call &call = *static_cast<const Call *>(user);
  Body &body = *call.body;
  const double drag = body.params[kDampingMass];
  for (uint32_t n = begin; n < end; ++n) {
    double *const sums = body.f.data();
    for (uint32_t m = body.merge_begin[n]; m < body.merge_begin[n + 1]; ++m)
      for (int a = 0; a < 3; ++a) sums[4 * size_t(body.merge[m].to) + a] += sums[4 * size_t(body.merge[m].from) + a];
    const Block &b = body.block[n];
    for (uint32_t i = 0; i < b.owned; ++i) {
      const size_t at = size_t(call.k->stride) * b.point[i];
      const double *sum = b.f + 4 * size_t(i);
      if (drag > 0) {
        const double c = drag * body.mass[b.point[i]];
        for (int a = 0; a < 3; ++a) call.f[at + a] += sum[a] - c * call.k->v[at + a];
      } else {
        for (int a = 0; a < 3; ++a) call.f[at + a] += sum[a];
      }
    }
  }
}

}  // namespace

const Kernels *choose_kernels(const dfm_host *host) {
  const Kernels *best = kernels_sse2();
  const bool avx2 = __builtin_cpu_supports("avx2");
  const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq");
  if (avx2) best = kernels_avx2();
  if (avx512) best = kernels_avx512();
  const char *forced = getenv("DEFORM_SIMD");
  if (!forced || !*forced) return best;
  if (!strcmp(forced, "sse2")) return kernels_sse2();
  if (!strcmp(forced, "avx2") && avx2) return kernels_avx2();
  if (!strcmp(forced, "avx512") && avx512) return kernels_avx512();
  host->log(host->ctx, 2, 0, "msm: DEFORM_SIMD is none of sse2, avx2, avx512 or this processor lacks it; the best it has is used.");
  return best;
}

void Body::for_each_block(void (*fn)(void *, uint32_t, uint32_t), void *user) {
  if (ncell >= kParallelCells && host->parallel_for) return host->parallel_for(host->ctx, nblock, 1, fn, user);
  fn(user, 0, nblock);
}

void Body::add_forces(const dfm_kin &k, double *f_out) {
  Call call{this, &k, f_out};
  for_each_block(force_pass, &call);
  for_each_block(merge_pass, &call);
}

double Body::energy(const dfm_kin &k) const {
  double springs = 0, volumes = 0;
  const double scale = spring_scale() * (young_field ? 1.0 : params[kYoung]);
  for (uint32_t e = 0; e < nedge; ++e) {
    const double stretch = length_of(k.x + size_t(k.stride) * edges[2 * size_t(e)], k.x + size_t(k.stride) * edges[2 * size_t(e) + 1]) - edge_length[e];
    springs += 0.5 * (scale * shape[e]) * (stretch * stretch);
  }
  if (has_volume())
    for (size_t c = 0, n = size_t(block[nblock - 1].cell + block[nblock - 1].cells - cell.data()); c < n; ++c) {
      if (cell_id[c] == kNone) continue;
      const uint32_t *q = cells.data() + 4 * size_t(cell_id[c]);
      const double *x[4];
      for (int a = 0; a < 4; ++a) x[a] = k.x + size_t(k.stride) * q[a];
      const double more = volume6_of(x[0], x[1], x[2], x[3]) - volume6[c];
      volumes += 0.5 * bulk[c] * (more * more);
    }
  return springs + volumes;
}

void Body::cell_energy(const dfm_kin &k, double *density) {
  const double scale = spring_scale() * (young_field ? 1.0 : params[kYoung]), ratio = volume_ratio();
  for (uint32_t e = 0; e < nedge; ++e) {
    const double stretch = length_of(k.x + size_t(k.stride) * edges[2 * size_t(e)], k.x + size_t(k.stride) * edges[2 * size_t(e) + 1]) - edge_length[e];
    edge_energy[e] = edge_volume[e] > 0 ? 0.5 * (scale * shape[e]) * (stretch * stretch) / edge_volume[e] : 0;
  }
  for (uint32_t c = 0; c < ncell; ++c) {
    double sum = 0;
    for (int n = 0; n < 6; ++n) sum += edge_energy[cell_edge[6 * size_t(c) + n]];
    const double *x[4];
    for (int a = 0; a < 4; ++a) x[a] = k.x + size_t(k.stride) * cells[4 * size_t(c) + a];
    if (has_volume() && cell_volume6[c] != 0) {
      const double strain = (volume6_of(x[0], x[1], x[2], x[3]) - cell_volume6[c]) / cell_volume6[c];
      sum += 0.5 * (ratio * young_of(c)) * (strain * strain);
    }
    density[c] = sum;
  }
}

void Body::bound(const dfm_kin &k, double *ksum, double *csum) const {
  const double damp = params[kDampingStiffness], drag = params[kDampingMass];
  for (uint32_t i = 0; i < npoint; ++i) {
    ksum[i] += 2 * spring_row[i];
    csum[i] += damp * (2 * spring_row[i]) + drag * mass[i];
  }
  if (!has_volume()) return;
  for (size_t c = 0, n = size_t(block[nblock - 1].cell + block[nblock - 1].cells - cell.data()); c < n; ++c) {
    if (bulk[c] == 0) continue;
    const uint32_t *q = cells.data() + 4 * size_t(cell_id[c]);
    double e[4][4] = {}, g[4] = {}, total = 0;  // e: edge lengths; g: 6 |dV/dx_a|, twice the area of the opposite face
    const double *x[4];
    for (int a = 0; a < 4; ++a) x[a] = k.x + size_t(k.stride) * q[a];
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) e[a][b] = length_of(x[a], x[b]);
    for (int a = 0; a < 4; ++a) {
      const double *o = x[(a + 1) & 3], *y = x[(a + 2) & 3], *z = x[(a + 3) & 3];
      const double u[3] = {y[0] - o[0], y[1] - o[1], y[2] - o[2]}, w[3] = {z[0] - o[0], z[1] - o[1], z[2] - o[2]};
      const double r[3] = {u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]};
      g[a] = __builtin_sqrt((r[0] * r[0] + r[1] * r[1]) + r[2] * r[2]), total += g[a];
    }
    const double more = __builtin_fabs(volume6_of(x[0], x[1], x[2], x[3]) - volume6[c]);
    for (int a = 0; a < 4; ++a) {  // block (a,b) of d2V: a cross product with the edge opposite to ab, over 6
      double opposite = 0;
      for (int i = 0; i < 4; ++i)
        for (int j = i + 1; j < 4; ++j)
          if (i != a && j != a) opposite += e[i][j];
      ksum[q[a]] += bulk[c] * (g[a] * total + more * opposite);
    }
  }
}

}  // namespace msm
