// The ops on the blocks. Forces run in two passes: each block loads its points and sums its cells into its
// own array, halo included; then each block adds up, in block order, what the others' halos hold for its
// points. No two workers write one place, and the order of every sum is fixed by the mesh.
#include "corot_body.h"

namespace corot {
namespace {

void force_pass(void *user, uint32_t begin, uint32_t end) {
  const Call &call = *static_cast<const Call *>(user);
  Body &body = *call.body;
  for (uint32_t n = begin; n < end; ++n) {
    const Block b = body.lend(n, begin);
    body.kernels->load(b, call.k->x, b.damp ? call.k->v : nullptr, call.k->stride);
    body.kernels->forces(b);
  }
}

void merge_pass(void *user, uint32_t begin, uint32_t end) {
  const Call &call = *static_cast<const Call *>(user);
  Body &body = *call.body;
  for (uint32_t n = begin; n < end; ++n) {
    const Block &b = body.block[n];
    body.kernels->merge(body.f.data(), body.merge.data() + body.merge_begin[n],
                        body.merge_begin[n + 1] - body.merge_begin[n]);
    for (uint32_t i = 0; !body.point_drag.empty() && i < b.owned; ++i) {
      const double c = body.point_drag[b.point[i]];
      const double *v = call.k->v + size_t(call.k->stride) * b.point[i];
      for (int a = 0; a < 3; ++a) b.f[4 * size_t(i) + a] -= c * v[a];
    }
    body.kernels->store(b, call.f, call.k->stride);
  }
}

void energy_pass(void *user, uint32_t begin, uint32_t end) {
  const Call &call = *static_cast<const Call *>(user);
  Body &body = *call.body;
  for (uint32_t n = begin; n < end; ++n) {
    const Block b = body.lend(n, begin);
    body.kernels->load(b, call.k->x, nullptr, call.k->stride);
    body.kernels->energies(b);
  }
}

}  // namespace

void Body::for_each_block(uint32_t least_cells, void (*fn)(void *, uint32_t, uint32_t), void *user) {
  if (ncell >= least_cells && host->parallel_for)
    return host->parallel_for(host->ctx, nblock, grain, fn, user);
  fn(user, 0, nblock);
}

void Body::add_forces(const dfm_kin &k, double *f_out) {
  Call call{this, &k, f_out};
  for_each_block(kParallelCells, force_pass, &call);
  for_each_block(kParallelMergeCells, merge_pass, &call);
}

double Body::energy(const dfm_kin &k) {
  Call call{this, &k, nullptr};
  for_each_block(kParallelCells, energy_pass, &call);
  double sum = 0;
  for (uint32_t c = 0; c < ncell; ++c) sum += value[place_of[c]];
  return sum;
}

void Body::cell_energy(const dfm_kin &k, double *out) {
  Call call{this, &k, nullptr};
  for_each_block(kParallelCells, energy_pass, &call);
  for (uint32_t c = 0; c < ncell; ++c) out[c] = volume[c] > 0 ? value[place_of[c]] / volume[c] : 0;
}

}  // namespace corot
