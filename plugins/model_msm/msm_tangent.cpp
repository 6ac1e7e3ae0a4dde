// Tangent of the forces, in blocks of 3x3: the points by themselves in their order, then the springs in the
// order of the mesh's edges, the lower point first. The points of a cell are pairwise ends of springs, so its
// terms need no further blocks. With n = d/|d|, l = |d|, the block of a spring is
//   df_i/dx_j = A n n^T + T (I - n n^T),
//   A, T      derivative of the tension along the spring, tension over l,
//   df_i/dv_j = k damp l^2/L^2 n n^T (form B), k damp l/L n n^T (form A),
// and of a cell, y the six volumes that count, E(y) its energy (msm_kernel.h),
//   df_a/dx_b = -E''(y) grad_a y (grad_b y)^T - E'(y) d2y/dx_a dx_b.
// Left out, so that the sum stays negative semidefinite: A and T below zero (a compressed spring buckles),
// the second derivative of the volume, and what a damper's force changes as its spring turns, which is not
// symmetric.
#include "../model_common/edges.h"
#include "msm_body.h"

namespace msm {

using model::kEdgeOf;

namespace {

// blk += s u w^T
void add_dyad(double *blk, double s, const double *u, const double *w) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) blk[3 * r + c] += (s * u[r]) * w[c];
}

using model::cross;

// Six volumes that count of four corners, and their gradient by each corner.
double counted_volume6(const double *const *x, double limit, double (*gradient)[3]) {
  double e[4][3] = {};
  for (int a = 1; a < 4; ++a)
    for (int n = 0; n < 3; ++n) e[a][n] = x[a][n] - x[0][n];
  cross(e[2], e[3], gradient[1]);
  cross(e[3], e[1], gradient[2]);
  cross(e[1], e[2], gradient[3]);
  for (int n = 0; n < 3; ++n) gradient[0][n] = -((gradient[1][n] + gradient[2][n]) + gradient[3][n]);
  const double six = volume6_of(x[0], x[1], x[2], x[3]);
  double q = 0;
  for (const auto &pair : kEdgeOf) q += square_between(x[pair[0]], x[pair[1]]);
  if (!(q > limit)) return six;
  const double u = limit / q, power = __builtin_sqrt(u) * u;
  const double share = power * (2.5 - 1.5 * u), by_q = -3.75 * (power * (1 - u)) / q;
  for (int n = 0; n < 3; ++n) {
    const double middle = 0.25 * ((x[0][n] + x[1][n]) + (x[2][n] + x[3][n]));
    for (int a = 0; a < 4; ++a)
      gradient[a][n] = share * gradient[a][n] + six * by_q * (8 * (x[a][n] - middle));
  }
  return six * share;
}

}  // namespace

// A and T of a spring; both zero where it carries no force.
Body::SpringTangent Body::spring_tangent(uint32_t e, double square, const Branch &branch) const {
  const double k = stiffness_of(e);
  if (!(square > kShortestSquared)) return {0, 0};
  if (form() == kTurned) {
    const double l = __builtin_sqrt(square), length = __builtin_sqrt(square + edge_tilt[e]);
    return {k * (l / length), std::max(k * ((length - rest_length(e)) / l), 0.0)};
  }
  const double length = __builtin_sqrt(edge_tilt.empty() ? square : square + edge_tilt[e]);
  const double more = length - rest_length(e);
  const double follow = has_branch() ? branch.follow : 1;
  const double tension = follow * more + (has_branch() ? branch.part * branch.state[e] : 0);
  const double across = k * (tension / length);
  const double along = across + (k * follow - across) * (square / (length * length));
  return {std::max(along, 0.0), std::max(across, 0.0)};
}

void Body::add_springs(const dfm_kin &k, double a, double b, double *blk) const {
  const Branch branch = branch_at(k);
  const double even = damp_scale() * params[kDampingStiffness];
  for (uint32_t e = 0; e < nedge; ++e) {
    const uint32_t i = edges[2 * size_t(e)], j = edges[2 * size_t(e) + 1];
    const double *const xi = k.x + size_t(k.stride) * i;
    const double *const xj = k.x + size_t(k.stride) * j;
    const double square = square_between(xi, xj);
    const SpringTangent t = spring_tangent(e, square, branch);
    double along = a * t.along;
    const double across = a * t.across;
    if (damping_on && square > kShortestSquared) {
      const double tilt2 = edge_tilt.empty() ? 0 : edge_tilt[e], ratio = square / (square + tilt2);
      along += b * (stiffness_of(e) * (edge_damp.empty() ? even : edge_damp[e])) *
               (form() == kTurned ? __builtin_sqrt(ratio) : ratio);
    }
    if (along == 0 && across == 0) continue;
    const double d[3] = {xj[0] - xi[0], xj[1] - xi[1], xj[2] - xi[2]};
    double own[9] = {across, 0, 0, 0, across, 0, 0, 0, across};
    add_dyad(own, (along - across) / square, d, d);
    double *const pair = blk + 9 * (size_t(npoint) + e);
    double *const first = blk + 9 * size_t(i);
    double *const second = blk + 9 * size_t(j);
    for (int n = 0; n < 9; ++n) {
      pair[n] += own[n];
      first[n] -= own[n];
      second[n] -= own[n];
    }
  }
}

void Body::add_cells(const dfm_kin &k, double a, double *blk) const {
  for (size_t c = 0, n = cell_slots(); c < n; ++c) {
    const double stiffest = bulk[c] + collapse[c];
    if (cell_id[c] == kNone || !(stiffest > 0)) continue;
    const uint32_t *const q = cells.data() + 4 * size_t(cell_id[c]);
    const uint32_t *const e = cell_edge.data() + 6 * size_t(cell_id[c]);
    const double *x[4];
    for (int m = 0; m < 4; ++m) x[m] = k.x + size_t(k.stride) * q[m];
    double g[4][3];
    const double now = counted_volume6(x, limit[c], g), rest6 = volume6[c];
    if (!(now > kMinVolume * rest6 && now < kMaxVolume * rest6)) continue;  // the pressure is constant
    const double s = -a * (now < kCollapseBelow * rest6 ? stiffest : bulk[c]);
    for (int m = 0; m < 4; ++m) add_dyad(blk + 9 * size_t(q[m]), s, g[m], g[m]);
    for (int m = 0; m < 6; ++m) {
      const int u = kEdgeOf[m][0], w = kEdgeOf[m][1];
      const bool ordered = q[u] < q[w];
      add_dyad(blk + 9 * (size_t(npoint) + e[m]), s, g[ordered ? u : w], g[ordered ? w : u]);
    }
  }
}

void Body::add_stiffness(const dfm_kin &k, double a, double b, double *blk) const {
  add_springs(k, a, b, blk);
  if (cells_on) add_cells(k, a, blk);
  for (uint32_t i = 0; drag_on && i < npoint; ++i) {
    const double c = b * ((point_drag.empty() ? params[kDampingMass] : point_drag[i]) * mass[i]);
    for (int n = 0; n < 9; n += 4) blk[9 * size_t(i) + size_t(n)] -= c;
  }
}

void Body::pattern(uint32_t *ij) const {
  for (uint32_t i = 0; i < npoint; ++i) ij[2 * size_t(i)] = ij[2 * size_t(i) + 1] = i;
  for (size_t e = 0; e < nedge; ++e) {
    ij[2 * (npoint + e)] = std::min(edges[2 * e], edges[2 * e + 1]);
    ij[2 * (npoint + e) + 1] = std::max(edges[2 * e], edges[2 * e + 1]);
  }
}

}  // namespace msm
