#include "cells.h"

#include "../model_common/cell_rows.h"
#include "../model_common/material.h"
#include "as_cpp.h"

namespace gpu {
namespace {

// The kernels: their functions are members here.
struct CellForces {
  const Call &call;
#include "cell_forces.glsl"
};
struct CellMotion {
  const Call &call;
#include "cell_motion.glsl"
};

void find_forces(const Call &call, uint32_t begin, uint32_t end) {
  CellForces cells{call};
  for (uint32_t i = begin; i < end; ++i) cells.force_of_cell(i);
}
void move_points(const Call &call, uint32_t begin, uint32_t end) {
  CellMotion points{call};
  for (uint32_t i = begin; i < end; ++i) points.move_corners(i);
}

}  // namespace

const Cells::Rows Cells::kRows = {{
    {"young", "Young's modulus", "Pa", 1e-3, 1e13, 1e5,
     DFM_PARAM_RUNTIME | DFM_PARAM_LOG_SCALE | DFM_PARAM_PER_CELL, 1, nullptr},
    {"damping_stiffness", "damping over stiffness", "s", 0, 10, 0, DFM_PARAM_RUNTIME, 1, nullptr},
    {"damping_mass", "drag over mass of each point", "1/s", 0, 1e6, 0, DFM_PARAM_RUNTIME, 1, nullptr},
    kDeviceRow,
    {"poisson", "Poisson ratio", "1", -0.99, 0.4999, 0.3, DFM_PARAM_RUNTIME | DFM_PARAM_PER_CELL, 1, nullptr},
}};

void Cells::create(const dfm_host *h, const dfm_mesh &m) {
  take_points(h, m);
  model::take_fields(h, kId, kRows.of, kParamCount, m, field_, [](uint32_t, double) { return true; });
  ncell_ = m.ncell;
  drawn = true;
  cells_.create_copy(h, m.cells, 4 * size_t(ncell_));
  rest_.create(h, ncell_);
  corners_.create(h, npoint, ncell_, cells_.data());
  shapes_.create(h, corners_.entries);
  twist_share_.create(h, 4 * size_t(ncell_));
  for (size_t c = 0; c < ncell_; ++c) {
    const auto at = [&](int a) { return m.rest + 3 * size_t(cells_[4 * c + size_t(a)]); };
    model::Tetrahedron &shape = rest_[c].shape;
    // a cell without volume gets zero gradients, and so no stiffness
    shape.volume = model::make_tetrahedron(at(0), at(1), at(2), at(3), shape) ? std::fabs(shape.volume) : 0;
  }
}

void Cells::fill(const double *params) {
  damping = params[kDampingStiffness];
  drag = params[kDampingMass];
  for (uint32_t c = 0; c < ncell_; ++c) {
    Rest &of = rest_[c];
    const model::Lame lame = model::lame_of(this->of(kYoung, params, c), this->of(kPoisson, params, c));
    of.mu2 = 2 * lame.mu * of.shape.volume;
    of.lambda = lame.lambda * of.shape.volume;
    const double *a = of.shape.g[1], *b = of.shape.g[2], *e = of.shape.g[3];
    shapes_[Corners::entry_of(c, 0)] = {a[0], a[1], a[2], b[0]};
    shapes_[Corners::entry_of(c, 1)] = {b[1], b[2], e[0], e[1]};
    shapes_[Corners::entry_of(c, 2)] = {e[2], of.mu2, of.lambda, 0};
  }
  find_rows();
  const char **effect = active_effects;
  *effect++ = "volume";
  *effect++ = "large_rotation";
  if (damping > 0 || drag > 0) *effect++ = "damping";
  *effect = nullptr;
}

void Cells::find_rows() {
  Buffer<double> norms, heights, weight, next;
  norms.create(host, 10 * size_t(ncell_));
  heights.create(host, 4 * size_t(ncell_));
  weight.create(host, npoint);
  next.create(host, npoint);
  for (size_t c = 0; c < ncell_; ++c) {
    model::Tetrahedron shape = rest_[c].shape;
    shape.volume = 1;  // the constants hold it
    double d[6][6];
    model::elasticity_matrix(model::Lame{std::max(double(rest_[c].lambda), 0.0), 0.5 * rest_[c].mu2}, d);
    model::block_norms(shape, d, norms.data() + 10 * c);
    for (size_t a = 0; a < 4; ++a) {
      const double *g = shape.g[a];
      heights[4 * c + a] = std::sqrt((g[0] * g[0] + g[1] * g[1]) + g[2] * g[2]);
    }
  }
  std::fill(row.data(), row.data() + npoint, 0.0);
  model::cell_rows(ncell_, npoint, cells_.data(), mass.data(), norms.data(), heights.data(), weight.data(),
                   next.data(), [&](uint32_t c, int a, double own, double turn) {
                     const size_t corner = 4 * size_t(c) + size_t(a);
                     row[cells_[corner]] += own;
                     twist_share_[corner] = float(turn);
                   });
  corners_.put_rows(row.data(), mass.data(), npoint);
  for (size_t c = 0; c < ncell_; ++c) corners_.put_shares(c, twist_share_.data() + 4 * c);
}

void Cells::strain(const dfm_kin &k, size_t c, double (&f)[9], double (&r)[9], double (&e)[6]) const {
  const uint32_t *const q = cells_.data() + 4 * c;
  const double *const x0 = k.x + size_t(q[0]) * k.stride;
  const Call none{};
  CellForces of{none};
  double d[9], g[9];
  for (size_t n = 0; n < 9; ++n) {
    d[n] = k.x[size_t(q[n / 3 + 1]) * k.stride + n % 3] - x0[n % 3];
    g[n] = rest_[c].shape.g[n / 3 + 1][n % 3];
  }
  of.gradient_of(d, g, f);
  of.polar_of(f, r);
  of.strain_of(r, f, e);
}

// What each shape adds to the rows at rest, as the kernel counts it.
void Cells::add_growth(const dfm_kin &k, double *ksum, double *csum) {
  for (size_t c = 0; c < ncell_; ++c) {
    const Call none{};
    double f[9], r[9], e[6];
    strain(k, c, f, r, e);
    const dvec2 more = CellForces{none}.growth_of(f, e, rest_[c].mu2, rest_[c].lambda);
    const double twist = more.x + (lag > 0 ? damping * more.y / lag : 0),
                 damper = lag > 0 ? 0 : damping * more.y;
    for (size_t n = 4 * c; n < 4 * c + 4; ++n) {
      ksum[cells_[n]] += twist * double(twist_share_[n]);
      csum[cells_[n]] += damper * double(twist_share_[n]);
    }
  }
}

Work Cells::work() const {
  Work w;
  w.add(kCellForces, 0, ncell_, find_forces);
  w.add(kCellMotion, 0, npoint, move_points);
  corners_.add_to(w, npoint);
  w.array[kShapes] = {sizeof(dvec4) * corners_.entries, shapes_.data()};
  return w;
}

double Cells::energy(const dfm_kin &k, uint32_t begin, uint32_t end) const {
  double sum = 0;
  for (size_t c = begin; c < end; ++c) {
    double f[9], r[9], e[6];
    strain(k, c, f, r, e);
    const double trace = (e[0] + e[1]) + e[2], own = (e[0] * e[0] + e[1] * e[1]) + e[2] * e[2];
    const double mixed = (e[3] * e[3] + e[4] * e[4]) + e[5] * e[5];
    sum += 0.5 * (rest_[c].mu2 * (own + 2 * mixed) + rest_[c].lambda * (trace * trace));
  }
  return sum;
}

}  // namespace gpu
