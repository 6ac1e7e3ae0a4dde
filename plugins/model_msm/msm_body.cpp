// The ops on the blocks. Forces run in two passes: each block loads its points, sums its springs and cells into its own array,
// halo included; then each block adds up, in block order, what the others' halos hold for its points. No two workers write
// one place, and the order of every sum is fixed by the mesh.
#include "msm_body.h"

#include <stdlib.h>

namespace msm {
namespace {

void force_pass(void *user, uint32_t begin, uint32_t end) {
  const Call &call = *static_cast<const Call *>(user);
  Body &body = *call.body;
  const double damp = body.params[kDampingStiffness];
  for (uint32_t n = begin; n < end; ++n) {
    const Block b = body.lend(n, begin);
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
    const Block &b = body.block[n];
    body.kernels->merge(body.f.data(), body.merge.data() + body.merge_begin[n], body.merge_begin[n + 1] - body.merge_begin[n]);
    for (uint32_t i = 0; drag > 0 && i < b.owned; ++i) {
      const double c = drag * body.mass[b.point[i]], *v = call.k->v + size_t(call.k->stride) * b.point[i];
      for (int a = 0; a < 3; ++a) b.f[4 * size_t(i) + a] -= c * v[a];
    }
    body.kernels->store(b, call.f, call.k->stride);
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

void Body::for_each_block(uint32_t least_cells, void (*fn)(void *, uint32_t, uint32_t), void *user) {
  if (ncell >= least_cells && host->parallel_for) return host->parallel_for(host->ctx, nblock, grain, fn, user);
  fn(user, 0, nblock);
}

void Body::add_forces(const dfm_kin &k, double *f_out) {
  Call call{this, &k, f_out};
  for_each_block(kParallelCells, force_pass, &call);
  for_each_block(kParallelMergeCells, merge_pass, &call);
}

double Body::stretch_of(uint32_t e, const dfm_kin &k) const {
  const uint32_t *ends = edges.data() + 2 * size_t(e);
  return length_of(k.x + size_t(k.stride) * ends[0], k.x + size_t(k.stride) * ends[1]) - edge_length[e];
}

double Body::energy(const dfm_kin &k) const {
  double springs = 0, volumes = 0;
  const double scale = spring_scale_of_shape();
  for (uint32_t e = 0; e < nedge; ++e) {
    const double stretch = stretch_of(e, k);
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
  const double scale = spring_scale_of_shape(), ratio = volume_ratio();
  for (uint32_t e = 0; e < nedge; ++e) {
    const double stretch = stretch_of(e, k);
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

}  // namespace msm
