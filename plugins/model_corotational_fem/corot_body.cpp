// The ops on the blocks. Forces run in two passes: each block loads its points and sums its cells into its
// own array, halo included; then each block adds up, in block order, what the others' halos hold for its
// points. No two workers write the same place, and the mesh alone determines the order of every sum.
#include <deform/elementary.h>

#include "corot_body.h"

namespace corot {

Block Body::load_block(const dfm_kin &k, uint32_t n, uint32_t begin, bool moves) {
  Block b = lend(n, begin);
  b.state = k.state;
  b.state_out = k.state_out;
  b.flow = flow_at(k);
  b.per_flow = b.flow > 0 ? 1 / b.flow : 0;
  kernels->load(b, k.x, moves ? k.v : nullptr, k.stride);
  for (uint32_t i = 0; b.nodal && i < b.local; ++i) {
    const double *change = point_change.data() + 2 * size_t(b.point[i]);
    b.p[8 * size_t(i) + 3] = change[0];
    b.p[8 * size_t(i) + 7] = change[1];
  }
  return b;
}

double Body::flow_at(const dfm_kin &k) const {
  return plastic() ? model::plastic::flow_in(params[kCreep], k.dt) : 0;
}

void Body::add_forces(const dfm_kin &k, double *f_out) {
  if (nodal()) dilate(k);
  for_each_block(ncell >= kParallelCells, [&](uint32_t n, uint32_t begin) {
    kernels->forces(load_block(k, n, begin, !damp.empty()));
  });
  for_each_block(ncell >= kParallelMergeCells, [&](uint32_t n, uint32_t) {
    const Block &b = block[n];
    merge_block(*kernels, n);
    for (uint32_t i = 0; !point_drag.empty() && i < b.owned; ++i) {
      const double c = point_drag[b.point[i]];
      const double *v = k.v + size_t(k.stride) * b.point[i];
      for (int a = 0; a < 3; ++a) b.f[4 * size_t(i) + a] -= c * v[a];
    }
    kernels->store(b, f_out, k.stride);
  });
}

// Uses the logarithm, which kernels do not have: one cell at a time.
double Body::direct_energy(const dfm_kin &k, size_t place) const {
  const uint32_t c = cell_id[place], lane = uint32_t(place % kGroup);
  const Group &own = group[place / kGroup];
  const double *x[4];
  corners(k, c, x);
  double grad[9], n = 0;
  gradient_of(own, lane, x, grad);
  for (const double entry : grad) n += entry * entry;
  const double mu2 = own.mu2[lane], lambda = own.lambda[lane];
  if (choice(kEnergy) == kVenant) {
    double square = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const double e =
            0.5 * (((grad[i] * grad[j] + grad[3 + i] * grad[3 + j]) + grad[6 + i] * grad[6 + j]) -
                   (i == j ? 1 : 0));
        square += e * e;
      }
    const double trace = 0.5 * (n - 3);
    return 0.5 * (mu2 * square + lambda * (trace * trace));
  }
  const double m = 2.0 / 3 * mu2, l = lambda + 5.0 / 12 * mu2;
  const double more = (grad[0] * (grad[4] * grad[8] - grad[5] * grad[7]) +
                       grad[1] * (grad[5] * grad[6] - grad[3] * grad[8])) +
                      grad[2] * (grad[3] * grad[7] - grad[4] * grad[6]) - 1;
  return 0.5 * (m * ((n - 3) - dfm_log((n + 1) / 4)) + l * (more * more)) - 0.75 * m * more;
}

void Body::fill_energies(const dfm_kin &k) {
  if (nodal()) dilate(k);
  if (choice(kEnergy) == kLinear)
    return for_each_block(ncell >= kParallelCells, [&](uint32_t n, uint32_t begin) {
      kernels->energies(load_block(k, n, begin, false));
    });
  for (size_t place = 0; place < lanes(); ++place)
    if (cell_id[place] != kNone) value[place] = direct_energy(k, place);
}

double Body::energy(const dfm_kin &k) {
  fill_energies(k);
  double sum = 0;
  for (uint32_t c = 0; c < ncell; ++c) sum += value[place_of[c]];
  return sum;
}

void Body::cell_energy(const dfm_kin &k, double *out) {
  fill_energies(k);
  for (uint32_t c = 0; c < ncell; ++c) out[c] = volume[c] > 0 ? value[place_of[c]] / volume[c] : 0;
}

void Body::cell_stress(const dfm_kin &k, double *out) {
  if (nodal()) dilate(k);
  for_each_block(ncell >= kParallelCells, [&](uint32_t n, uint32_t begin) {
    const Block b = load_block(k, n, begin, false);
    kernels->stresses(b, b.cell, out);
  });
  for (size_t n = 0; n < 6 * size_t(ncell); ++n) out[n] = volume[n / 6] > 0 ? out[n] / volume[n / 6] : 0;
}

void gradient_of(const Group &group, uint32_t lane, const double *const *x, double *f) {
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l)
      f[3 * k + l] = ((x[1][k] - x[0][k]) * group.g[l][lane] + (x[2][k] - x[0][k]) * group.g[3 + l][lane]) +
                     (x[3][k] - x[0][k]) * group.g[6 + l][lane];
}

}  // namespace corot
