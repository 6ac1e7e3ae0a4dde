// K is the sum over the cells of V [ lambda g_a g_b^T + mu g_b g_a^T + mu (g_a.g_b) I ], the block between
// corners a and b, g their gradients. Its rows sum to zero, so forces are taken of differences,
//   f_i = - sum_j K_ij (w_j - w_i),   w = u + damping_stiffness v,
// and a translated body has zero forces up to the rounding of its positions. Rows are summed in the order of
// the neighbors: bits do not depend on the division of the work.

#include <algorithm>
#include <cmath>

#include "../model_common/edges.h"
#include "../model_common/params.h"
#include "linear_body.h"

namespace linear {

using model::kEdgeOf;

namespace {

// From this size on rows go through the host's parallel_for, in pieces of this many points.
constexpr uint32_t kParallelCells = 10000, kGrain = 512;

// out -= K d, of a block or (second end of an edge) its transpose.
void take_product(const double *k, bool transposed, const double *d, double *out) {
  const int row = transposed ? 1 : 3, column = transposed ? 3 : 1;
  for (int r = 0; r < 3; ++r)
    out[r] -= (k[row * r] * d[0] + k[row * r + column] * d[1]) + k[row * r + 2 * column] * d[2];
}

}  // namespace

void Body::take_mesh(const dfm_mesh &m) {
  npoint = m.npoint;
  ncell = m.ncell;
  nedge = m.nedge;
  rest.create_copy(host, m.rest, 3 * size_t(npoint));
  mass.create_copy(host, m.mass, npoint);
  cells.create_copy(host, m.cells, 4 * size_t(ncell));
  edges.create_copy(host, m.edges, 2 * size_t(nedge));
  cell_edge.create(host, 6 * size_t(ncell));
  block.create(host, 9 * size_t(nedge));
  drag.create(host, npoint);
  volume.create(host, npoint);
  ksum.create(host, npoint);
  csum.create(host, npoint);
  for (size_t c = 0; c < ncell; ++c)
    model::find_edges(edges.data(), nedge, cells.data() + 4 * c, cell_edge.data() + 6 * c);
}

void Body::take_fields(const dfm_mesh &m) {
  model::take_fields(host, kId, kParams, kParamCount, m, field, [](uint32_t, double) { return true; });
  if (!field[kDampingStiffness].empty()) damp_block.create(host, 9 * size_t(nedge));
}

void Body::find_rows() {
  const auto each = [&](const auto &use) {
    for (uint32_t n = 0; n < 2 * nedge; ++n) use(edges[n], n);
  };
  model::make_lists(host, npoint, each, row_begin, row_edge);
  row_point.create(host, 2 * size_t(nedge));
  for (size_t s = 0; s < 2 * size_t(nedge); ++s) row_point[s] = edges[row_edge[s] ^ 1u];
}

void Body::create(const dfm_host *h, const dfm_mesh &m) {
  host = h;
  take_mesh(m);
  take_fields(m);
  find_rows();
  apply_params(m.params);
}

bool Body::cell(uint32_t c, Tetrahedron &out) const {
  const uint32_t *q = cells.data() + 4 * size_t(c);
  const auto x = [&](int a) { return rest.data() + 3 * size_t(q[a]); };
  return model::make_tetrahedron(x(0), x(1), x(2), x(3), out) && out.volume > 0;
}

void Body::apply_params(const double *values) {
  std::copy(values, values + kParamCount, params);
  std::fill(block.data(), block.data() + 9 * size_t(nedge), 0.0);
  if (!damp_block.empty()) std::fill(damp_block.data(), damp_block.data() + 9 * size_t(nedge), 0.0);
  for (Buffer<double> *sum : {&ksum, &csum, &drag, &volume})
    std::fill(sum->data(), sum->data() + npoint, 0.0);
  damping_on = drag_on = false;
  for (uint32_t c = 0; c < ncell; ++c) {
    Tetrahedron t;
    if (!cell(c, t)) continue;
    const model::Lame m = model::lame_of(at(kYoung, c), at(kPoisson, c));
    const double damp = at(kDampingStiffness, c), most = largest_stiffness(t, m);
    add_cell(c, t, m, damp);
    damping_on |= damp > 0;
    drag_on |= at(kDampingMass, c) > 0;
    for (size_t a = 0; a < 4; ++a) {
      const uint32_t i = cells[4 * size_t(c) + a];
      ksum[i] += most;
      csum[i] += damp * most;
      drag[i] += t.volume * at(kDampingMass, c);
      volume[i] += t.volume;
    }
  }
  for (uint32_t i = 0; i < npoint; ++i) {
    drag[i] = volume[i] > 0 ? mass[i] * (drag[i] / volume[i]) : 0;
    csum[i] += drag[i];
  }
  active_effects[0] = damping_on || drag_on ? "damping" : nullptr;
}

void Body::add_cell(uint32_t c, const Tetrahedron &t, const model::Lame &m, double damp) {
  const uint32_t *const q = cells.data() + 4 * size_t(c);
  for (size_t n = 0; n < 6; ++n) {
    const bool ordered = q[kEdgeOf[n][0]] < q[kEdgeOf[n][1]];
    const double *const ga = t.g[kEdgeOf[n][ordered ? 0 : 1]];
    const double *const gb = t.g[kEdgeOf[n][ordered ? 1 : 0]];
    const double across = m.mu * model::dot(ga, gb);
    const size_t first = 9 * size_t(cell_edge[6 * size_t(c) + n]);
    for (size_t r = 0; r < 3; ++r)
      for (size_t s = 0; s < 3; ++s) {
        const double k =
            t.volume * ((m.lambda * ga[r] * gb[s] + m.mu * gb[r] * ga[s]) + (r == s ? across : 0));
        block[first + 3 * r + s] += k;
        if (!damp_block.empty()) damp_block[first + 3 * r + s] += damp * k;
      }
  }
}

void Body::displacement(const dfm_kin &k, uint32_t point, double *u) const {
  for (size_t n = 0; n < 3; ++n) u[n] = k.x[size_t(k.stride) * point + n] - rest[3 * size_t(point) + n];
}

void Body::force_rows(const dfm_kin &k, double *f, uint32_t begin, uint32_t end) const {
  const double damp = damp_block.empty() && damping_on ? params[kDampingStiffness] : 0;
  const auto state = [&](uint32_t i, double *w) {
    displacement(k, i, w);
    for (size_t n = 0; damp > 0 && n < 3; ++n) w[n] += damp * k.v[size_t(k.stride) * i + n];
  };
  for (uint32_t i = begin; i < end; ++i) {
    double own[3], sum[3] = {};
    state(i, own);
    const double *const v = k.v + size_t(k.stride) * i;
    for (uint32_t s = row_begin[i]; s < row_begin[i + 1]; ++s) {
      const uint32_t j = row_point[s];
      const size_t first = 9 * size_t(row_edge[s] / 2);
      const bool second = row_edge[s] % 2;
      double d[3];
      state(j, d);
      for (int n = 0; n < 3; ++n) d[n] -= own[n];
      take_product(block.data() + first, second, d, sum);
      if (damp_block.empty() || !damping_on) continue;
      const double *const w = k.v + size_t(k.stride) * j;
      const double rate[3] = {w[0] - v[0], w[1] - v[1], w[2] - v[2]};
      take_product(damp_block.data() + first, second, rate, sum);
    }
    double *const out = f + size_t(k.stride) * i;
    for (int n = 0; n < 3; ++n) out[n] += drag_on ? sum[n] - drag[i] * v[n] : sum[n];
  }
}

void Body::add_forces(const dfm_kin &k, double *f) const {
  model::in_pieces(host, ncell >= kParallelCells, npoint, kGrain,
                   [&](uint32_t begin, uint32_t end) { force_rows(k, f, begin, end); });
}

void Body::bound(const dfm_kin &, double *k, double *c) const {
  for (uint32_t i = 0; i < npoint; ++i) {
    k[i] += ksum[i];
    c[i] += csum[i];
  }
}

// sum u_a g_a^T
void Body::gradient_of(uint32_t c, const dfm_kin &k, const Tetrahedron &t, double (&h)[3][3]) const {
  const uint32_t *const q = cells.data() + 4 * size_t(c);
  double u0[3], u[3];
  displacement(k, q[0], u0);
  for (size_t a = 1; a < 4; ++a) {
    displacement(k, q[a], u);
    for (size_t r = 0; r < 3; ++r)
      for (size_t s = 0; s < 3; ++s) h[r][s] += (u[r] - u0[r]) * t.g[a][s];
  }
}

// sym(sum u_a g_a^T): xx yy zz xy yz zx.
void Body::strain_of(uint32_t c, const dfm_kin &k, const Tetrahedron &t, double *e) const {
  double h[3][3] = {};
  gradient_of(c, k, t, h);
  for (size_t r = 0; r < 3; ++r) {
    e[r] = h[r][r];
    e[3 + r] = 0.5 * (h[r][(r + 1) % 3] + h[(r + 1) % 3][r]);
  }
}

// J/m3
double Body::density_of(uint32_t c, const dfm_kin &k, const Tetrahedron &t) const {
  double e[6];
  strain_of(c, k, t, e);
  const model::Lame m = model::lame_of(at(kYoung, c), at(kPoisson, c));
  const double trace = (e[0] + e[1]) + e[2];
  constexpr size_t kEntry[9] = {0, 3, 5, 3, 1, 4, 5, 4, 2};
  double square = 0;
  for (const size_t n : kEntry) square += e[n] * e[n];
  return 0.5 * m.lambda * (trace * trace) + m.mu * square;
}

double Body::energy(const dfm_kin &k) {
  double sum = 0;
  Tetrahedron t;
  for (uint32_t c = 0; c < ncell; ++c) {
    if (!cell(c, t)) continue;
    sum += t.volume * density_of(c, k, t);
    look_at(c, k, t);
  }
  range.warn(host, kId);
  return sum;
}

void Body::look_at(uint32_t c, const dfm_kin &k, const Tetrahedron &t) {
  double h[3][3] = {};
  gradient_of(c, k, t, h);
  range.look(c, h);
}

void Body::cell_energy(const dfm_kin &k, double *density) const {
  Tetrahedron t;
  for (uint32_t c = 0; c < ncell; ++c) density[c] = cell(c, t) ? density_of(c, k, t) : 0;
}

void Body::cell_stress(const dfm_kin &k, double *stress) const {
  Tetrahedron t;
  for (uint32_t c = 0; c < ncell; ++c) {
    double e[6] = {};
    if (cell(c, t)) strain_of(c, k, t, e);
    const model::Lame m = model::lame_of(at(kYoung, c), at(kPoisson, c));
    const double pressure = m.lambda * ((e[0] + e[1]) + e[2]);
    for (size_t n = 0; n < 6; ++n) stress[6 * size_t(c) + n] = 2 * m.mu * e[n] + (n < 3 ? pressure : 0);
  }
}

void Body::pattern(uint32_t *ij) const {
  for (uint32_t i = 0; i < npoint; ++i) ij[2 * size_t(i)] = ij[2 * size_t(i) + 1] = i;
  std::copy(edges.data(), edges.data() + 2 * size_t(nedge), ij + 2 * size_t(npoint));
}

void Body::add_stiffness(const dfm_kin &, double a, double b, double *blk) const {
  const double all = damp_block.empty() ? a + b * params[kDampingStiffness] : a;
  for (size_t e = 0; e < nedge; ++e) {
    double *const first = blk + 9 * size_t(edges[2 * e]);
    double *const second = blk + 9 * size_t(edges[2 * e + 1]);
    double *const pair = blk + 9 * (npoint + e);
    for (size_t r = 0; r < 3; ++r)
      for (size_t s = 0; s < 3; ++s) {
        double k = all * block[9 * e + 3 * r + s];
        if (!damp_block.empty()) k += b * damp_block[9 * e + 3 * r + s];
        pair[3 * r + s] -= k;
        first[3 * r + s] += k;
        second[3 * s + r] += k;
      }
  }
  for (size_t i = 0; drag_on && i < npoint; ++i)
    for (size_t n = 0; n < 9; n += 4) blk[9 * i + n] -= b * drag[i];
}

}  // namespace linear
