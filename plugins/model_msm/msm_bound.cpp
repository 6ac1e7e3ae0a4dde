// Row sums for the step bound (doc/models/msm.md). With K and C the stiffness and damping of the body, any D
// >= K and E >= C that are diagonal (Loewner order) make h^2 D + 2 h E <= 4 M sufficient for symplectic
// Euler; doc/models/msm.md proves it. The rows are
//   D_i = |A_i| + sum_j k_ij w_j / w_i + cells,
//   A_i = sum_j k_ij ((1 - s) n n^T + s I),   s = max(0, 1 - L0/L)
// (the page has A_i and k_ij where extra coordinates count) with positive weights w, chosen once so that the
// rows are even: they come from a few steps toward the Perron vector of the row-sum operator. Every w gives a
// bound, a good one gives nearly the true step (0.95 of it on a free mesh, 0.6 for w = 1).
//
// Cells beyond Qm, whose volume counts as V t, t = u^(3/2) (5 - 3 u)/2 with u = Qm/Q. F maps the regular unit
// cell to the cell, n = |F|: Q = 2 n^2, V = det F/(6 sqrt 2); corner displacements change F by at most sqrt 2
// times their norm. |cof F| <= n^2/sqrt 3, |det F| <= n^3/(3 sqrt 3), |d2 det F| <= 2 n/sqrt 3. With
// m = Qm/2 = u n^2 the gradient of D = t det F is t cof F - c F, c = 15/2 u^(3/2) (1 - u) det F/n^2, and
// cof F : F = 3 det F gives, with k = 15/2 u^(3/2) (1 - u) and 6 t - k = u^(3/2) (15 - 3 u)/2 > 0,
//   |dD|^2 = t^2 |cof F|^2 - (det F)^2/n^2 k (6 t - k) <= t^2 n^4/3 = m^2/3 u (5 - 3 u)^2/4 <= 1.544 m^2/3.
// With d2t/d(n^2)^2 = 15/4 u^(3/2) (5 - 7 u)/2/n^4,
//   |d2D| <= sqrt(m/3) u [ (5 - 3 u) + 35/2 (1 - u) + 5/2 |5 - 7 u| ] <= 8.06 sqrt(m/3).
// By the positions: |d(V t)|^2 <= 1.544 Qm^2/432, |d2(V t)| <= 0.776 sqrt(Qm).
#include <algorithm>

#include "../model_common/even_rows.h"
#include "msm_body.h"

namespace msm {
namespace {

// A bound of |A_i| that turning the body does not change: the largest eigenvalue of a symmetric 3 x 3 matrix
// is at most mean + sqrt(2/3) |deviator| (equal where the other two eigenvalues are), and each spring adds at
// most its stiffness.
double norm_of(const double *a, double spring_sum) {
  const double mean = ((a[0] + a[1]) + a[2]) / 3, x = a[0] - mean, y = a[1] - mean, z = a[2] - mean;
  const double deviator2 = ((x * x + y * y) + z * z) + 2 * ((a[4] * a[4] + a[5] * a[5]) + a[6] * a[6]);
  return std::min(mean + __builtin_sqrt(deviator2 * (2.0 / 3)), spring_sum);
}

}  // namespace

template <class Use>
void Body::each_row(const dfm_kin &k, const Use &use) {
  for_each_block(ncell >= kParallelCells, [&](uint32_t n, uint32_t begin) {
    Block b = lend(n, begin);
    if (has_branch() && k.state) {
      rest_of_branches(n, k);
      b.rest = rest_now.data() + (b.stiffness - stiffness.data());
    }
    kernels->load(b, k.x, nullptr, k.stride);
    kernels->spring_rows[form()](b);
    if (cells_on) kernels->cell_rows(b);
  });
  for_each_block(ncell >= kParallelMergeCells, [&](uint32_t n, uint32_t) {
    const Block &b = block[n];
    kernels->merge_rows(row.data(), merge.data() + merge_begin[n], merge_begin[n + 1] - merge_begin[n]);
    for (uint32_t s = 0; s < b.owned; ++s) {
      const double *const sums = b.row + 8 * size_t(s);
      use(b.point[s], norm_of(sums, spring_sum[b.point[s]]), sums);
    }
  });
}

void Body::find_weights(Room &room) {
  // Along a spring at rest a tilted one is softer by (L0/L)^2, a turned one by L0/L.
  const auto tangent = [this](uint32_t e) {
    const double k = full_stiffness(e);
    const double ratio = edge_tilt.empty() || !(edge_rest[e] > 0) ? 1 : edge_length[e] / edge_rest[e];
    return form() == kPlain ? k : form() == kTurned ? k * ratio : k * (ratio * ratio);
  };
  std::fill(spring_sum.data(), spring_sum.data() + npoint, 0.0);
  for (uint32_t e = 0; e < nedge; ++e)
    for (int n = 0; n < 2; ++n) spring_sum[edges[2 * size_t(e) + n]] += full_stiffness(e);
  // gradient: 6 |dV/dx_a| sqrt(kV / (36 V0)) at rest
  Buffer<double> &own = room.own, &next = room.next, &gradient = room.gradient;
  dfm_kin at_rest{};
  at_rest.x = rest_point.data();
  at_rest.stride = 3;
  each_row(at_rest, [&](uint32_t i, double norm, const double *) { own[i] = norm; });
  if (volume_on)
    for (uint32_t c = 0; c < ncell; ++c) rest_gradients(c, gradient.data() + 4 * size_t(c));
  Buffer<double> &stiff = room.tangent;
  for (uint32_t e = 0; e < nedge; ++e) stiff[e] = tangent(e);
  model::even_rows(npoint, mass.data(), weight.data(), next.data(), [&](double *out) {
    for (uint32_t i = 0; i < npoint; ++i) out[i] = own[i] * weight[i];
    for (uint32_t e = 0; e < nedge; ++e) {
      const uint32_t i = edges[2 * size_t(e)], j = edges[2 * size_t(e) + 1];
      out[i] += stiff[e] * weight[j];
      out[j] += stiff[e] * weight[i];
    }
    for (uint32_t c = 0; volume_on && c < ncell; ++c) {
      const uint32_t *q = cells.data() + 4 * size_t(c);
      const double *g = gradient.data() + 4 * size_t(c);
      const double sum =
          (g[0] * weight[q[0]] + g[1] * weight[q[1]]) + (g[2] * weight[q[2]] + g[3] * weight[q[3]]);
      for (int a = 0; a < 4; ++a) out[q[a]] += g[a] * sum;
    }
  });
  std::fill(coupled.data(), coupled.data() + npoint, 0.0);
  for (uint32_t e = 0; e < nedge; ++e) {
    const uint32_t i = edges[2 * size_t(e)], j = edges[2 * size_t(e) + 1];
    coupled[i] += full_stiffness(e) * weight[j] / weight[i];
    coupled[j] += full_stiffness(e) * weight[i] / weight[j];
  }
  for (uint32_t n = 0; n < slot_begin[nblock]; ++n) slot_weight[n] = weight[point[n]];
  std::fill(rest_rows.data(), rest_rows.data() + npoint, 0.0);
  std::fill(own.data(), own.data() + npoint, 0.0);
  std::fill(next.data(), next.data() + npoint, 0.0);
  bound(at_rest, own.data(), next.data());
  rest_rows.swap(own);
}

void Body::bound(const dfm_kin &k, double *ksum, double *csum) {
  each_row(k, [&](uint32_t i, double norm, const double *sums) {
    const double springs = norm + (edge_tilt.empty() ? coupled[i] : sums[3]);
    const double most = damp_most.empty() ? damp_scale() * params[kDampingStiffness] : damp_most[i];
    ksum[i] += std::max(springs + sums[7] / weight[i], rest_rows[i]);
    // A damper's n n^T is at most its spring's part of A_i over k.
    csum[i] += most * springs + (point_drag.empty() ? params[kDampingMass] : point_drag[i]) * mass[i];
  });
}

}  // namespace msm
