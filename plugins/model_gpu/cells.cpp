#include "cells.h"

#include <atomic>

#include "../model_common/cell_rows.h"
#include "../model_common/material.h"
#include "as_cpp.h"

namespace gpu {
namespace {

// The kernels: their functions are members here.
struct CellForces {
  const Call &call;
#define CORNER(i) call.of<const uvec4>(kOwn + 1)[i]
#define SHAPE(i) call.of<const dvec4>(kOwn + 2)[i]
#define FORCE(i, value) call.of<dvec4>(kOwn + 3)[i] = value
#include "cell_forces.glsl"
};
struct CellMotion {
  const Call &call;
#define ROW(i) call.of<const uvec2>(kOwn)[i]
#define CORNER_FORCE(i) call.of<const dvec4>(kOwn + 3)[i]
#define REST_ROW(i) call.of<const double>(kOwn + 4)[i]
#define RAISE(rate) raise(*call.of<uint32_t>(kHighest), rate)
  static void raise(uint32_t &to, float value) {
    const std::atomic_ref<uint32_t> all(to);
    const uint32_t bits = std::bit_cast<uint32_t>(value);
    for (uint32_t seen = all; seen < bits && !all.compare_exchange_weak(seen, bits);) {}
  }
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

// Of one of the three entries of a cell, 32 cells side by side.
size_t place_of(size_t c, size_t part) { return c / kSide * kSide * 3 + part * kSide + c % kSide; }

}  // namespace

void Cells::create(const dfm_host *h, const dfm_mesh &m) {
  take_points(h, m.npoint);
  std::copy(m.mass, m.mass + npoint, mass.data());
  model::take_fields(h, kId, gpu::kParams, kParams, m, field_, [](uint32_t, double) { return true; });
  ncell_ = m.ncell;
  cells_.create_copy(h, m.cells, 4 * size_t(ncell_));
  rest_.create(h, ncell_);
  entries_ = (size_t(ncell_) + kSide - 1) / kSide * kSide * 3;
  corners_.create(h, entries_);
  shapes_.create(h, entries_);
  twist_share_.create(h, 4 * size_t(ncell_));
  places_.create(h, npoint);
  row_by_mass_.create(h, npoint);
  for (Buffer<double> *each : {&twist_, &damper_}) each->create(h, ncell_);
  for (size_t n = 0; n < 4 * size_t(ncell_); ++n) ++places_[cells_[n]].y;
  room_ = gpu::lay_out(places_, npoint);
  Buffer<uint32_t> next;
  next.create(h, npoint);
  for (size_t c = 0; c < ncell_; ++c) {
    const uint32_t *const q = cells_.data() + 4 * c;
    const double *x[4];
    uint32_t to[4];
    for (int a = 0; a < 4; ++a) {
      x[a] = m.rest + 3 * size_t(q[a]);
      to[a] = places_[q[a]].x + kSide * next[q[a]]++;
    }
    model::Tetrahedron &shape = rest_[c].shape;
    // a cell without volume gets zero gradients, and so no stiffness
    shape.volume = model::make_tetrahedron(x[0], x[1], x[2], x[3], shape) ? std::fabs(shape.volume) : 0;
    corners_[place_of(c, 0)] = {q[0], q[1], q[2], q[3]};
    corners_[place_of(c, 1)] = {to[0], to[1], to[2], to[3]};
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
    shapes_[place_of(c, 0)] = {a[0], a[1], a[2], b[0]};
    shapes_[place_of(c, 1)] = {b[1], b[2], e[0], e[1]};
    shapes_[place_of(c, 2)] = {e[2], of.mu2, of.lambda, 0};
  }
  find_rows();
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
    model::elasticity_matrix(model::Lame{rest_[c].lambda, 0.5 * rest_[c].mu2}, d);
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
  for (uint32_t i = 0; i < npoint; ++i) row_by_mass_[i] = row[i] / mass[i];
  for (size_t c = 0; c < ncell_; ++c) {
    const float *s = twist_share_.data() + 4 * c;
    corners_[place_of(c, 2)] = {std::bit_cast<uint>(s[0]), std::bit_cast<uint>(s[1]),
                                std::bit_cast<uint>(s[2]), std::bit_cast<uint>(s[3])};
  }
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

// What each shape adds to the rows at rest, as the kernel counts it. After a step the kernel has found the
// sub-step that no point asks to be shorter; as dampers, points ask for that and leave room to what else acts
// on them. The worst point at rest is named.
void Cells::bound(const dfm_kin &k, double *ksum, double *csum) {
  constexpr double kOthers = 1 - 1e-6;
  if (const double last = k.state[3 * size_t(npoint)]; last > 0) {
    const double stable = std::min(last, longest);  // parameters may have changed since
    for (uint32_t i = 0; i < npoint; ++i) csum[i] += (i == worst ? 1 : kOthers) * (2 * mass[i] / stable);
    return;
  }
  each(host, ncell_, [&](size_t c) {
    const Call none{};
    double f[9], r[9], e[6];
    strain(k, c, f, r, e);
    const dvec2 more = CellForces{none}.growth_of(f, e, rest_[c].mu2, rest_[c].lambda);
    twist_[c] = more.x + (lag > 0 ? damping * more.y / lag : 0);
    damper_[c] = lag > 0 ? 0 : damping * more.y;
  });
  for (uint32_t i = 0; i < npoint; ++i) {
    ksum[i] += stiff(i);
    csum[i] += damper(i);
  }
  for (size_t n = 0; n < 4 * size_t(ncell_); ++n) {
    ksum[cells_[n]] += twist_[n / 4] * double(twist_share_[n]);
    csum[cells_[n]] += damper_[n / 4] * double(twist_share_[n]);
  }
}

Work Cells::work() const {
  return {{{kCellForces, ncell_, find_forces}, {kCellMotion, npoint, move_points}},
          2,
          {{sizeof(uvec2) * npoint, places_.data()},
           {sizeof(uvec4) * entries_, corners_.data()},
           {sizeof(dvec4) * entries_, shapes_.data()},
           {sizeof(dvec4) * room_, nullptr},
           {sizeof(double) * npoint, row_by_mass_.data()}}};
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
