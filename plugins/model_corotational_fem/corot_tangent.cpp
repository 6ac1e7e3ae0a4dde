// Tangent of the forces, in blocks of 3x3: the points by themselves in their order, then the edges of the
// mesh in theirs. The usual one is R K_e R^T, from the kernels: symmetric, no eigenvalue above zero. The
// exact one, cell by cell here, is the derivative with the turning of R. With the notation of
// corot_bound.cpp
//   d2W = usual + sum_k max(0, e_k) q_k^2.
// e_k < 0 is left out, so that the sum stays negative semidefinite: it belongs to the three turns alone,
// which nothing else in d2W touches, and cutting it off is the projection of d2W. With v_k the axes of S, a
// motion u of corner b has q_k = (R (v_k x g_b)).u / sqrt 2. Dampers, and fibers: L_a^T D L_b, L_b u the
// change of S (the damper's times its fading, see strain_rate in corot_kernel_cells.h). What fibers under
// stress change as S turns against their axes is left out.
#include "../model_common/edges.h"
#include "../model_common/modes.h"
#include "../model_common/plastic.h"
#include "corot_body.h"
#include "corot_collapse.h"

namespace corot {
namespace {

using namespace model::plastic;
using model::cross;
using model::product;
using model::rotation::Single;

constexpr double kMin = 1e-12;  // two stretches that cancel, over the trace

// A cell at one shape: rotation, rest gradients, S with its axes (columns) and stretches.
struct Shape {
  double r[9], g[4][3], s[3][3], axis[3][3], stretch[3], trace;

  // Change of S in xx yy zz xy yz zx, shear doubled, for a motion of corner b along the frame's axis i.
  void change(int b, int i, double *out) const {
    double w[3] = {}, e[3] = {}, ws[3][3], a[3][3] = {}, axial[3];
    e[i] = 1;
    for (int l = 0; l < 3; ++l) a[i][l] = g[b][l];
    cross(g[b], e, axial);  // of e g^T
    for (int k = 0; k < 3; ++k) {
      const int m = (k + 1) % 3, n = (k + 2) % 3;
      const double part = (axis[0][k] * axial[0] + axis[1][k] * axial[1]) + axis[2][k] * axial[2];
      const double pair = stretch[m] + stretch[n];
      if (pair > kMin * trace)
        for (int l = 0; l < 3; ++l) w[l] += part / pair * axis[l][k];
    }
    for (int l = 0; l < 3; ++l) {
      const double column[3] = {s[0][l], s[1][l], s[2][l]};
      double turned[3];
      cross(w, column, turned);
      for (int k = 0; k < 3; ++k) ws[k][l] = turned[k];
    }
    constexpr int kRow[6] = {0, 1, 2, 0, 1, 2}, kCol[6] = {0, 1, 2, 1, 2, 0};
    for (int n = 0; n < 6; ++n) {
      const int k = kRow[n], l = kCol[n];
      const double both = (a[k][l] - ws[k][l]) + (a[l][k] - ws[l][k]);
      out[n] = n < 3 ? 0.5 * both : both;
    }
  }
  // det(t I - S) over what it counts as at least
  double share() const {
    const double det = (stretch[0] + stretch[1]) * (stretch[1] + stretch[2]) * (stretch[2] + stretch[0]);
    const double least = kMinPair * (trace * trace * trace);
    return det < least ? (least > 0 ? std::max(det / least, 0.0) : 0) : 1;
  }
};

// Fills in everything except the axes of S and what follows from them.
void frame_at(const Group &group, uint32_t lane, const double *const *x, Shape &out) {
  double f[9];
  for (int k = 0; k < 9; ++k) out.g[k / 3 + 1][k % 3] = group.g[k][lane];
  for (int k = 0; k < 3; ++k) out.g[0][k] = -((out.g[1][k] + out.g[2][k]) + out.g[3][k]);
  gradient_of(group, lane, x, f);
  model::split(f, out.r, out.s);
}

void shape_at(const Group &group, uint32_t lane, const double *const *x, Shape &out) {
  frame_at(group, lane, x, out);
  double s[3][3];
  std::copy(&out.s[0][0], &out.s[0][0] + 9, &s[0][0]);
  model::jacobi(s, out.axis);
  for (int k = 0; k < 3; ++k) out.stretch[k] = s[k][k];
  out.trace = (s[0][0] + s[1][1]) + s[2][2];
}

// Negative values are set to zero.
void modes_of(uint32_t energy, const double *s, double mu2, double lambda, model::Modes &out) {
  const double n = (s[0] * s[0] + s[1] * s[1]) + s[2] * s[2], det = s[0] * s[1] * s[2];
  const double m = 2.0 / 3 * mu2, l = lambda + 5.0 / 12 * mu2, pull = m - m / (n + 1);
  const double pressure = l * (det - 1) - 0.75 * m;
  if (energy == kVenant) model::venant_modes(lambda, 0.5 * mu2, s, out);
  for (int i = 0; energy != kVenant && i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double u = s[(i + 1) % 3] * s[(i + 2) % 3], w = s[(j + 1) % 3] * s[(j + 2) % 3];
      out.stretch[i][j] = 2 * m / ((n + 1) * (n + 1)) * (s[i] * s[j]) + l * (u * w) +
                          (i == j ? pull : pressure * s[3 - i - j]);
    }
    out.turn[i] = pull + pressure * s[i];
    out.shear[i] = pull - pressure * s[i];
  }
  model::cut_negative(out);
}

// out -= r m r^T
void take_turned(const double *r, const double (*m)[3], double *out) {
  double half[3][3];
  for (int j = 0; j < 3; ++j) {
    const double column[3] = {m[0][j], m[1][j], m[2][j]};
    double out_column[3];
    product(r, column, out_column);
    for (int i = 0; i < 3; ++i) half[i][j] = out_column[i];
  }
  for (int i = 0; i < 3; ++i) {
    double row[3];
    product(r, half[i], row);
    for (int j = 0; j < 3; ++j) out[3 * i + j] -= row[j];
  }
}

// add(m, n, its block) for each block of a cell.
template <class Add>
void each_block(const SlotGroup &at, uint32_t lane, double *blk, const Add &add) {
  for (int m = 0; m < 4; ++m) add(m, m, blk + 9 * size_t(at.slot[m][lane]));
  for (int e = 0; e < 6; ++e)
    add(model::kEdgeOf[e][0], model::kEdgeOf[e][1], blk + 9 * size_t(at.slot[4 + e][lane]));
}

}  // namespace

void Body::pattern(uint32_t *ij) const {
  for (uint32_t i = 0; i < npoint; ++i) ij[2 * size_t(i)] = ij[2 * size_t(i) + 1] = i;
  for (size_t e = 0; e < nedge; ++e) {
    ij[2 * (npoint + e)] = std::min(edges[2 * e], edges[2 * e + 1]);
    ij[2 * (npoint + e) + 1] = std::max(edges[2 * e], edges[2 * e + 1]);
  }
  uint32_t *far = ij + 2 * (size_t(npoint) + nedge);
  for (uint32_t i = 0; nodal() && i < npoint; ++i)
    for (uint32_t n = patches.far_begin[i]; n < patches.far_begin[i + 1]; ++n) {
      *far++ = i;
      *far++ = patches.far_point[n];
    }
}

// Takes from the elasticity d, times the volume, what the flow at the stretch s takes. False: no plastic
// strain; `flows`: now.
bool Body::soften_cell(const dfm_kin &k, uint32_t c, const double (*s)[3], double (*d)[6],
                       bool &flows) const {
  const size_t place = place_of[c], lane = place % kGroup;
  const PlasticGroup &own = plastic_group[place / kGroup];
  const double part = flow_at(k), e[6] = {s[0][0] - 1, s[1][1] - 1, s[2][2] - 1, s[0][1], s[1][2], s[2][0]};
  const PlasticLaw<Single> law = {
      group[place / kGroup].mu2[lane], own.yield[lane], own.hardening[lane], own.limit[lane], part,
      part > 0 ? 1 / part : 0};
  PlasticState<Single> state;
  const double *from = k.state + kState * size_t(c);
  std::copy(from, from + 6, state.strain);
  state.length = from[6];
  PlasticFlow<Single> flow;
  find_flow<Single>(law, e, state, flow);
  flows = soften(law, flow, d);
  return flows || square_of<Single>(state.strain) > 0;
}

// Blocks of one cell: by the change of S, by R K_e R^T, by the turns.
void Body::add_exact(const dfm_kin &k, uint32_t c, double a, double b, double *blk) const {
  const size_t place = place_of[c];
  const uint32_t lane = uint32_t(place % kGroup);
  const Group &own = group[place / kGroup];
  const double *x[4];
  corners(k, c, x);
  Shape shape;
  shape_at(own, lane, x, shape);
  const double share = shape.share(), damping = damp.empty() ? 0 : b * damp[place] * (share * share);
  const bool direct = choice(kEnergy) != kLinear;
  model::Modes modes{};
  double principal[4][3];
  if (direct) modes_of(choice(kEnergy), shape.stretch, own.mu2[lane], own.lambda[lane], modes);
  double d[6][6], soft[6][6], change[4][3][6], turned[3][4][3], twist[3] = {};
  cell_elasticity(place, d);
  std::copy(&d[0][0], &d[0][0] + 36, &soft[0][0]);
  bool now = false;
  const bool flows = plastic() && soften_cell(k, c, shape.s, soft, now);
  const bool by_fiber = !fiber.empty() && share >= 1, by_flow = flows && share >= 1;
  const double change_by = damping + (by_fiber ? a : 0), flow_by = by_flow ? a : 0;
  const double frame_by = by_fiber || by_flow || direct ? 0 : a;
  const double bulk_here = own.lambda[lane] + own.mu2[lane] / 3;
  for (int i = 0; nodal() && i < 9; ++i) {
    d[i / 3][i % 3] -= bulk_here;
    soft[i / 3][i % 3] -= bulk_here;
  }
  model::Tetrahedron rest{1, {}};  // the constants hold the volume
  for (int m = 0; m < 4; ++m) {
    std::copy(shape.g[m], shape.g[m] + 3, rest.g[m]);
    for (int i = 0; i < 3; ++i)
      principal[m][i] = (shape.axis[0][i] * shape.g[m][0] + shape.axis[1][i] * shape.g[m][1]) +
                        shape.axis[2][i] * shape.g[m][2];
    for (int i = 0; i < 3; ++i) {
      shape.change(m, i, change[m][i]);
      const double axis[3] = {shape.axis[0][i], shape.axis[1][i], shape.axis[2][i]};
      cross(axis, shape.g[m], turned[i][m]);
    }
  }
  const double more = shape.trace - 3;
  const double pressure =
      nodal() ? bulk_here * mean_change(c) - own.mu2[lane] / 3 * more : own.lambda[lane] * more;
  const double pull = pressure - own.mu2[lane];
  for (int m = 0; fiber.empty() && !flows && !direct && m < 3; ++m) {
    const double pair = std::max(shape.stretch[(m + 1) % 3] + shape.stretch[(m + 2) % 3], kMin * shape.trace);
    if (pair > 0) twist[m] = 0.5 * a * std::max(0.0, own.mu2[lane] + 2 * pull / pair);
  }
  const auto add_block = [&](int m, int n, double *out) {
    double frame[9], elastic[9] = {}, in_frame[3][3];
    model::stiffness_block(rest, soft, m, n, frame);
    if (direct) model::elastic_block(modes, principal[m], principal[n], elastic);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        double sum = frame_by * frame[3 * i + j];
        for (int e = 0; direct && e < 3; ++e)
          for (int l = 0; l < 3; ++l) sum += a * (shape.axis[i][e] * elastic[3 * e + l] * shape.axis[j][l]);
        for (int e = 0; e < 3; ++e) sum += twist[e] * (turned[e][m][i] * turned[e][n][j]);
        for (int e = 0; change_by != 0 && e < 6; ++e)
          for (int l = 0; l < 6; ++l) sum += change_by * (change[m][i][e] * (d[e][l] * change[n][j][l]));
        for (int e = 0; flow_by != 0 && e < 6; ++e)
          for (int l = 0; l < 6; ++l) sum += flow_by * (change[m][i][e] * (soft[e][l] * change[n][j][l]));
        in_frame[i][j] = sum;
      }
    take_turned(shape.r, in_frame, out);
  };
  each_block(slots[place / kGroup], lane, blk, add_block);
  if (!direct && params[kCollapse] > 0) add_collapse(place, x, shape.g, a, blk);
}

// The second derivative of the energy against collapse, without that of the volume, which is not definite.
void Body::add_collapse(size_t place, const double *const *x, const double (*g)[3], double a,
                        double *blk) const {
  const uint32_t lane = uint32_t(place % kGroup);
  const Group &own = group[place / kGroup];
  double grad[9], area[4][3], cofactor[9];
  gradient_of(own, lane, x, grad);
  for (int k = 0; k < 3; ++k) cross(grad + 3 * ((k + 1) % 3), grad + 3 * ((k + 2) % 3), cofactor + 3 * k);
  const double det = (grad[0] * cofactor[0] + grad[1] * cofactor[1]) + grad[2] * cofactor[2];
  if (!(det < kFlat)) return;
  const double young =
      fiber.empty() ? young_of<Single>(own.mu2[lane], own.lambda[lane]) : fiber[place / kGroup].young[lane];
  const double by = a * collapse_of<Single>(params[kCollapse], det, young).stiffness;
  for (int m = 0; m < 4; ++m) product(cofactor, g[m], area[m]);
  each_block(slots[place / kGroup], lane, blk, [&](int m, int n, double *out) {
    for (int k = 0; k < 9; ++k) out[k] -= by * (area[m][k / 3] * area[n][k % 3]);
  });
}

// Subtracts from the blocks of the elastic tangent what the plastic flow of the cell takes.
void Body::add_softening(const dfm_kin &k, uint32_t c, double a, double *blk) const {
  const size_t place = place_of[c];
  const uint32_t lane = uint32_t(place % kGroup);
  const Group &own = group[place / kGroup];
  Shape shape;
  const double *x[4];
  corners(k, c, x);
  frame_at(own, lane, x, shape);
  double less[6][6] = {};
  bool flows = false;
  soften_cell(k, c, shape.s, less, flows);
  if (!flows) return;
  model::Tetrahedron rest{1, {}};  // the constants hold the volume
  for (int m = 0; m < 4; ++m) std::copy(shape.g[m], shape.g[m] + 3, rest.g[m]);
  const auto add_block = [&](int m, int n, double *out) {
    double frame[9], in_frame[3][3];
    model::stiffness_block(rest, less, m, n, frame);
    for (int i = 0; i < 9; ++i) in_frame[i / 3][i % 3] = a * frame[i];
    take_turned(shape.r, in_frame, out);
  };
  each_block(slots[place / kGroup], lane, blk, add_block);
}

void Body::add_stiffness(const dfm_kin &k, double a, double b, double *blk) {
  if (nodal()) {
    dilate(k);
    add_nodal(k, a, b, blk);
  }
  if (choice(kTangent) == kExact) {
    for (uint32_t c = 0; c < ncell; ++c)
      if (volume[c] > 0) add_exact(k, c, a, b, blk);
  } else {
    for (uint32_t n = 0; n < nblock; ++n) kernels->tangents(load_block(k, n, 0, false), a, b, blk);
    for (uint32_t c = 0; plastic() && c < ncell; ++c)
      if (volume[c] > 0) add_softening(k, c, a, blk);
  }
  for (uint32_t i = 0; !point_drag.empty() && i < npoint; ++i)
    for (int n = 0; n < 9; n += 4) blk[9 * size_t(i) + size_t(n)] -= b * point_drag[i];
}

}  // namespace corot
