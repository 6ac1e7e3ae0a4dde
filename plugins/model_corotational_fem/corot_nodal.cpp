// Volume change by points, against locking near poisson 1/2 (after J. Bonet and A. J. Burton, A simple
// average nodal pressure tetrahedral element for incompressible and nearly incompressible dynamic explicit
// applications, Comm. Numer. Meth. Engng 14, 1998). With t the trace of the stretch of a cell, k its bulk
// modulus and V its volume,
//   W = sum over cells of V mu |dev e|^2 + sum over points of K/2 change^2,
//   change = sum over the cells around the point of k V/4 (t - 3) / K,   K = sum of k V/4.
// In a uniform strain of one material that is the energy of the cells; in any other it is no more, because
// the square of a mean is no more than the mean of the squares. dt = R:dF, so the stress of a cell is
//   2 mu dev e + k mean(change of its corners) I,
// of the axes of S as before: forces are the gradient of W, and no torque is left. The tangent has for each
// point the dyad of the gradient of its volume change, which joins all points of the cells around it; its
// second derivative is in the turns of corot_bound.cpp. Dampers have the rate in place of the change, with
// weights damp k V/4.
#include "../model_common/edges.h"
#include "../model_common/index.h"
#include "../model_common/rotation.h"
#include "corot_body.h"

namespace corot {

void Body::dilate(const dfm_kin &k) {
  for_each_block(ncell >= kParallelCells, [&](uint32_t n, uint32_t begin) {
    kernels->dilate(load_block(k, n, begin, !damp.empty()));
  });
  for_each_block(ncell >= kParallelMergeCells, [&](uint32_t n, uint32_t) {
    const Block &b = block[n];
    merge_block(*kernels, n);
    for (uint32_t i = 0; i < b.owned; ++i)
      for (size_t m = 0; m < 2; ++m) {
        const double all = bulk[2 * size_t(b.point[i]) + m];
        point_change[2 * size_t(b.point[i]) + m] = all > 0 ? b.f[4 * size_t(i) + m] / all : 0;
      }
  });
}

void Body::find_bulk() {
  std::fill(bulk.data(), bulk.data() + 2 * size_t(npoint), 0.0);
  for (uint32_t c = 0; c < ncell; ++c) {
    const model::Lame m = model::lame_of(at(kYoung, c), at(kPoisson, c));
    const double part = 0.25 * volume[c] * (m.lambda + 2 * m.mu / 3);
    for (int a = 0; a < 4; ++a) {
      const uint32_t i = cells[4 * size_t(c) + size_t(a)];
      bulk[2 * size_t(i)] += part;
      bulk[2 * size_t(i) + 1] += at(kDampingStiffness, c) * part;
    }
  }
}

Body::Patches &Body::ready_patches() const {
  if (patches.made) return patches;
  find_patches(patches);
  find_far_points(patches);
  patches.gradient.create(host, 3 * size_t(patches.begin[npoint]));
  patches.pair_slot.create(host, patches.pair_begin[npoint]);
  for (uint32_t i = 0; i < npoint; ++i) {
    uint32_t at = patches.pair_begin[i];
    for (uint32_t n = patches.begin[i]; n < patches.begin[i + 1]; ++n)
      for (uint32_t m = n; m < patches.begin[i + 1]; ++m)
        patches.pair_slot[at++] = slot_of(patches, patches.point[n], patches.point[m]);
  }
  patches.made = true;
  return patches;
}

// The points of the cells around a point are itself and its neighbors along edges.
void Body::find_patches(Patches &to) const {
  const auto each = [&](const auto &use) {
    for (uint32_t i = 0; i < npoint; ++i) use(i, i);
    for (size_t n = 0; n < 2 * size_t(nedge); ++n) use(edges[n], edges[n ^ 1u]);
  };
  model::make_lists(host, npoint, each, to.begin, to.point);
  to.pair_begin.create(host, size_t(npoint) + 1);
  for (uint32_t i = 0; i < npoint; ++i) {
    const uint64_t size = to.begin[i + 1] - to.begin[i];
    to.pair_begin[i + 1] =
        model::after(to.pair_begin[i], size * (size + 1) / 2, "more than 4 billion pairs of points");
    std::sort(to.point.data() + to.begin[i], to.point.data() + to.begin[i + 1]);
  }
}

// Points two edges away: counted, then listed.
void Body::find_far_points(Patches &to) const {
  Buffer<uint32_t> seen;
  seen.create(host, npoint);
  to.far_begin.create(host, size_t(npoint) + 1);
  const auto each_far = [&](uint32_t i, auto &&use) {
    for (uint32_t n = to.begin[i]; n < to.begin[i + 1]; ++n) seen[to.point[n]] = i;
    for (uint32_t n = to.begin[i]; n < to.begin[i + 1]; ++n)
      for (uint32_t m = to.begin[to.point[n]]; m < to.begin[to.point[n] + 1]; ++m) {
        const uint32_t j = to.point[m];
        if (seen[j] == i) continue;
        seen[j] = i;
        if (j > i) use(j);
      }
  };
  std::fill(seen.data(), seen.data() + npoint, kNone);
  for (uint32_t i = 0; i < npoint; ++i) {
    to.far_begin[i + 1] = to.far_begin[i];
    each_far(i, [&](uint32_t) { ++to.far_begin[i + 1]; });
  }
  to.far_point.create(host, to.far_begin[npoint]);
  std::fill(seen.data(), seen.data() + npoint, kNone);
  for (uint32_t i = 0; i < npoint; ++i) {
    uint32_t at = to.far_begin[i];
    each_far(i, [&](uint32_t j) { to.far_point[at++] = j; });
    std::sort(to.far_point.data() + to.far_begin[i], to.far_point.data() + at);
  }
}

// The slot of the block (i, j), i <= j, both in one patch.
uint32_t Body::slot_of(const Patches &in, uint32_t i, uint32_t j) const {
  if (i == j) return i;
  const uint32_t *const all = in.far_point.data(), *const end = all + in.far_begin[i + 1];
  const uint32_t *const found = std::lower_bound(all + in.far_begin[i], end, j);
  if (found != end && *found == j) return npoint + nedge + uint32_t(found - all);
  return npoint + model::find_edge(edges.data(), nedge, i, j);
}

// Finds the gradients of the volume change of each patch's point, or of its rate by the velocities, times
// what divides it.
void Body::find_gradients(const dfm_kin &k, bool damped) {
  std::fill(patches.gradient.data(), patches.gradient.data() + 3 * size_t(patches.begin[npoint]), 0.0);
  for (uint32_t c = 0; c < ncell; ++c) {
    const size_t place = place_of[c], lane = place % kGroup;
    const Group &own = group[place / kGroup];
    const uint32_t *q = cells.data() + 4 * size_t(c);
    const double *x[4];
    corners(k, c, x);
    double grad[9], r[9], pull[4][3] = {};
    gradient_of(own, uint32_t(lane), x, grad);
    model::rotation::polar_of(grad, r);
    const double part = 0.25 * (own.lambda[lane] + own.mu2[lane] / 3) * (damped ? damp[place] : 1);
    for (size_t m = 1; m < 4; ++m)
      for (size_t i = 0; i < 3; ++i) {
        const double *g = &own.g[3 * (m - 1)][lane];
        pull[m][i] = part * ((r[3 * i] * g[0] + r[3 * i + 1] * g[kGroup]) + r[3 * i + 2] * g[2 * kGroup]);
        pull[0][i] -= pull[m][i];
      }
    for (size_t n = 0; n < 4; ++n)
      for (size_t m = 0; m < 4; ++m) {
        const uint32_t *const all = patches.point.data();
        const uint32_t *const first = all + patches.begin[q[n]], *const last = all + patches.begin[q[n] + 1];
        double *const to = patches.gradient.data() + 3 * size_t(std::lower_bound(first, last, q[m]) - all);
        for (size_t i = 0; i < 3; ++i) to[i] += pull[m][i];
      }
  }
}

// kind 0: of the volume change, 1: of its rate.
void Body::add_dyads(size_t kind, double by, double *blk) const {
  const double *const g = patches.gradient.data();
  for (uint32_t n = 0; n < npoint; ++n) {
    const double all = bulk[2 * size_t(n) + kind];
    if (!(all > 0)) continue;
    const uint32_t *slot = patches.pair_slot.data() + patches.pair_begin[n];
    for (size_t i = patches.begin[n]; i < patches.begin[n + 1]; ++i)
      for (size_t j = i; j < patches.begin[n + 1]; ++j) {
        double *const out = blk + 9 * size_t(*slot++);
        for (size_t e = 0; e < 9; ++e) out[e] -= by / all * (g[3 * i + e / 3] * g[3 * j + e % 3]);
      }
  }
}

void Body::add_nodal(const dfm_kin &k, double a, double b, double *blk) {
  find_gradients(k, false);
  add_dyads(0, a, blk);
  if (damp.empty() || b == 0) return;
  find_gradients(k, true);
  add_dyads(1, b, blk);
}

}  // namespace corot
