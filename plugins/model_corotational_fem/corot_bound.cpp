// Row sums for the step bound (doc/models/corotational_fem.md). With K and C the stiffness and damping of the
// body, any D >= K and E >= C that are diagonal (Loewner order) make h^2 D + 2 h E <= 4 M sufficient for
// symplectic Euler. K is the sum over cells of R K_e R^T, and of what the turning of R adds. With N_ab the
// norm of the block (a, b) of K_e, which no rotation changes, and any positive weights w
//   D_a = sum over cells of (sum_b N_ab w_b) / w_a
// is such a diagonal: |u_a N_ab u_b| <= N_ab/2 (w_b/w_a u_a^2 + w_a/w_b u_b^2). The weights are chosen once
// so that the rows are even: 0.84 of the true step on a fine mesh, where the least h_min / c_p of a cell
// gives 0.06.
//
// The turning of R. The energy is mu |F - R|^2 + lambda/2 (t - 3)^2 with t = tr S, and R = dt/dF. Hence
//   d2W = 2 mu |dF|^2 + lambda (R:dF)^2 + (lambda (t - 3) - 2 mu) dF:dR,
// and dF:dR = sum_k 2/(s_i + s_j) q_k^2, q_k the parts of dF along the three unit matrices that turn the
// material against its frame. R K_e R^T has 2 mu |dF|^2 less 2 mu q_k^2, so what comes on top is
//   e_k q_k^2,   e_k = 2 mu + 2 (lambda (t - 3) - 2 mu)/(s_i + s_j),
// zero at rest, negative where the cell is pressed (left out: that makes no step shorter). sum q_k^2 is the
// square of the skew part of R^T dF, at most (sum_a |u_a| |g_a|)^2 / 2, so the row of the cell grows by
//   max(0, e) V/2 |g_a| (sum_b |g_b| w_b) / w_a.
// The damper works on dS/dt, whose mixed entries in the axes of S are (s_i A_ij + s_j A_ji)/(s_i + s_j), A
// = R^T dF/dt. Their squares are at most (A_ij^2 + A_ji^2)(1 + d^2)/2, d = (s_i - s_j)/(s_i + s_j), where R
// K_e R^T has the halves without d: the row of the damper grows by damp 2 mu d^2 V times the same factors.
// Where lambda < 0, its part takes from both matrices, and the rows are those without it.
// With fibers stress and S have different axes. Let D be the elasticity, |D| its largest eigenvalue. dS is
// the symmetric part of A less a matrix of norm at most d |A|/sqrt 2, which adds |D| (sqrt 2 d + d^2/2);
// and stress : d2S adds |stress| (6 sqrt(1 + d^2)/p + 6 s^2/p^3), p the least sum of two stretches, s the
// largest one: d2S = X solves S X + X S = 2 Q, Q = dS [w]x S - S [w]x dS + S [w]x^T [w]x S, |w| <= |A|/p.
// With the volume change of the points (corot_nodal.cpp) the square of their mean replaces the mean of the
// squares of their cells, which is no less (Jensen): the rows at rest hold. The pressure of c is that of the
// points.
// Plastic cells (plastic.h) have s = s(e) - 2 mu p with the flow's moduli in place of D, which are no
// more (the potential is a least value over the flow). What p adds is -2 mu p : d2S, and S X + X S = 2 (dF^T
// dF - dS^2) for X = d2S, from S^2 = F^T F. Both terms are positive semidefinite, so their difference is at
// most sqrt(|A|^4 + |dS|^4) in norm; |dS|^2 <= (1 + d^2) |A|^2; hence, with c the least sum of two stretches,
// |X| <= 2 sqrt 2 (1 + d^2) |A|^2 / c.
// The energies of the gradient have rows of their own, of the second derivative at the shape. In W'' each
// dyad X:dF with X of largest stretch x is at most x sum |u_a| |g_a|, |dF| too, and d2J is at most twice
// the longest stretch, at least minus once that.
#include "../model_common/cell_rows.h"
#include "corot_body.h"

namespace corot {

void Body::cell_elasticity(size_t place, double (*d)[6]) const {
  const Group &g = group[place / kGroup];
  const size_t lane = place % kGroup;
  const double mu = g.mu2[lane] / 2;
  if (fiber.empty()) return model::elasticity_matrix(model::Lame{g.lambda[lane], mu}, d);
  const FiberGroup &own = fiber[place / kGroup];
  const double axis[3] = {own.axis[0][lane], own.axis[1][lane], own.axis[2][lane]};
  model::elasticity_matrix({g.lambda[lane], mu, own.alpha[lane], own.beta[lane], mu + own.shear[lane] / 2},
                           axis, d);
}

void Body::find_rows(Room &room) {
  for (uint32_t c = 0; c < ncell; ++c) {
    const size_t place = place_of[c];
    model::Tetrahedron shape{1, {}};  // the constants hold the volume
    for (int k = 0; k < 9; ++k) shape.g[k / 3 + 1][k % 3] = group[place / kGroup].g[k][place % kGroup];
    for (int a = 0; a < 3; ++a) shape.g[0][a] = -((shape.g[1][a] + shape.g[2][a]) + shape.g[3][a]);
    double d[6][6];
    const Group &own = group[place / kGroup];
    const size_t lane = place % kGroup;
    const model::Lame pressed{std::max(own.lambda[lane], 0.0), own.mu2[lane] / 2};
    if (fiber.empty()) model::elasticity_matrix(pressed, d);
    else cell_elasticity(place, d);
    model::block_norms(shape, d, room.blocks.data() + 10 * size_t(c));
  }
  std::fill(rest_rows.data(), rest_rows.data() + npoint, 0.0);
  std::fill(damp_rows.data(), damp_rows.data() + npoint, 0.0);
  model::cell_rows(ncell, npoint, cells.data(), mass.data(), room.blocks.data(), height_inverse.data(),
                   weight.data(), room.next.data(), [&](uint32_t c, int a, double row, double turn) {
                     const size_t corner = 4 * size_t(c) + size_t(a);
                     rest_rows[cells[corner]] += row;
                     damp_rows[cells[corner]] += at(kDampingStiffness, c) * row;
                     twist_share[corner] = turn;
                   });
}

void Body::bound(const dfm_kin &k, double *ksum, double *csum) {
  if (nodal()) dilate(k);
  for_each_block(ncell >= kParallelCells,
                 [&](uint32_t n, uint32_t begin) { kernels->twists(load_block(k, n, begin, false)); });
  for (uint32_t i = 0; i < npoint; ++i) {
    ksum[i] += choice(kEnergy) == kLinear ? rest_rows[i] : 0;
    csum[i] += damp_rows[i] + (point_drag.empty() ? 0 : point_drag[i]);
  }
  for (uint32_t c = 0; c < ncell; ++c) {
    const double twist = value[place_of[c]], damper = damp.empty() ? 0 : damp_value[place_of[c]];
    if (!(twist > 0 || damper > 0)) continue;
    for (int a = 0; a < 4; ++a) {
      ksum[cells[4 * size_t(c) + a]] += twist * twist_share[4 * size_t(c) + a];
      csum[cells[4 * size_t(c) + a]] += damper * twist_share[4 * size_t(c) + a];
    }
  }
}

}  // namespace corot
