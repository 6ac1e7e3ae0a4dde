// Energies on vectors of four doubles, and the drag on a block's points. A sum takes one spring or cell
// after the other, as spring_energy.h does, so it has the same bits at every width. Internal linkage only.
#pragma once
#include "msm_kernel_quad.h"

namespace msm {
namespace {

DEFORM_INLINE double add_lanes(double sum, v4 a) {
  alignas(32) double each[4];
  store4(each, a);
  return (((sum + each[0]) + each[1]) + each[2]) + each[3];
}

static inline double spring_energies(const SpringList &s, const double *x, uint32_t stride, double sum) {
  const auto at = [&](uint32_t e, uint32_t end) __attribute__((always_inline)) {
    return load_xyz(x + size_t(stride) * s.edges[2 * size_t(e) + end]);
  };
  for (uint32_t e = 0; e < s.n; e += 4) {
    const v4 d0 = at(e, 1) - at(e, 0);
    const v4 d1 = at(e + 1, 1) - at(e + 1, 0);
    const v4 d2 = at(e + 2, 1) - at(e + 2, 0);
    const v4 d3 = at(e + 3, 1) - at(e + 3, 0);
    v4 square = sum_rows(d0 * d0, d1 * d1, d2 * d2, d3 * d3);
    if (s.tilt) square = square + load4_anywhere(s.tilt + e);
    const v4 stretch = sqrt4(square) - load4_anywhere(s.rest + e);
    const v4 stiffness = splat(s.scale) * load4_anywhere(s.shape + e);
    sum = add_lanes(sum, (splat(0.5) * stiffness) * (stretch * stretch));
  }
  return sum;
}

DEFORM_INLINE Three<Four> corners(const Block &b, const Cell *c, int n, const double *x, uint32_t stride) {
  const auto at = [&](int k) __attribute__((always_inline)) {
    return load_xyz(x + size_t(stride) * b.point[c[k].p[n]]);
  };
  Three<Four> out = {at(0), at(1), at(2)};
  v4 unused = at(3);
  transpose(out.x, out.y, out.z, unused);
  return out;
}

// Cells that fill up a block have no stiffness, so their energy is zero.
static inline double cell_energies(const Block &b, const double *x, uint32_t stride, double sum) {
  for (uint32_t t = 0; t < b.cells; t += 4) {
    const Cell *c = b.cell + t;
    const Three<Four> x0 = corners(b, c, 0, x, stride), x1 = corners(b, c, 1, x, stride);
    const Three<Four> x2 = corners(b, c, 2, x, stride), x3 = corners(b, c, 3, x, stride);
    const Three<Four> e1 = x1 - x0, e2 = x2 - x0, e3 = x3 - x0, d21 = x2 - x1, d31 = x3 - x1, d32 = x3 - x2;
    const v4 q =
        ((((dot(e1, e1) + dot(e2, e2)) + dot(d21, d21)) + dot(e3, e3)) + dot(d31, d31)) + dot(d32, d32);
    const v4 rest = load4(b.volume6 + t);
    v4 by_q;
    const v4 now = dot(e1, cross(e2, e3)) * fade<Four>(q, load4(b.limit + t), by_q);
    const v4 kept = min4(max4(now, splat(kMinVolume) * rest), splat(kMaxVolume) * rest), more = kept - rest;
    const v4 lost = max4(splat(kCollapseBelow) * rest - kept, splat(0));
    const v4 bulk = load4(b.bulk + t), collapse = load4(b.collapse + t), half = splat(0.5);
    sum = add_lanes(sum, (half * bulk * (more * more) + half * collapse * (lost * lost)) +
                             (bulk * more - collapse * lost) * (now - kept));
  }
  return sum;
}

// f -= c m v of the points that the block owns; by_point is NULL where c is the same for all.
static inline void drag_points(const model::BlockPoints &b, const double *mass, const double *by_point,
                               double all, const double *v, uint32_t stride) {
  const auto one = [&](uint32_t n) __attribute__((always_inline)) {
    const size_t i = b.point[n];
    take_from(b, n, splat((by_point ? by_point[i] : all) * mass[i]) * load_xyz(v + size_t(stride) * i));
  };
  if (!b.ahead) {
    for (uint32_t n = 0; n < b.owned; ++n) one(n);
    return;
  }
  for (uint32_t n = 0; n < b.owned; ++n) {
    const uint32_t place = n + b.ahead;  // after its own points come the halo, then those of the next block
    const size_t next = b.point[place < b.owned ? place : place - b.owned + b.local];
    fetch(v + size_t(stride) * next);
    fetch(mass + next);
    one(n);
  }
}

#define MSM_ENERGIES spring_energies, cell_energies, drag_points

}  // namespace
}  // namespace msm
