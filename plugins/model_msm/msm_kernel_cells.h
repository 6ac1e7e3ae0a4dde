// The volume terms of cells side by side, one to a lane, once for vectors of doubles and of floats. Ops has
// the vector V and its operations; for volume_cells() and cell_rows() also kLanes, gather, weights, spread.
// Internal linkage only.
#pragma once
#include "../model_common/block_lanes.h"
#include "msm_kernel.h"

namespace msm {
namespace {

// The same for every lane.
template <class Ops>
struct Three {
  typename Ops::V x, y, z;
};
template <class Ops>
DEFORM_INLINE Three<Ops> operator+(const Three<Ops> &a, const Three<Ops> &b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class Ops>
DEFORM_INLINE Three<Ops> operator-(const Three<Ops> &a, const Three<Ops> &b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class Ops>
DEFORM_INLINE Three<Ops> operator*(typename Ops::V a, const Three<Ops> &b) {
  return {a * b.x, a * b.y, a * b.z};
}
template <class Ops>
DEFORM_INLINE typename Ops::V dot(const Three<Ops> &a, const Three<Ops> &b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
template <class Ops>
DEFORM_INLINE Three<Ops> cross(const Three<Ops> &a, const Three<Ops> &b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Edges of the cells from their first corner, and for each the vector product of the other two.
template <class Ops>
struct Cells {
  Three<Ops> e1, e2, e3, g1, g2, g3;
};

// place: of the first of the cells, in the arrays of the block.
template <class Ops, class AnyBlock>
DEFORM_INLINE typename Ops::V pressure_of(const AnyBlock &b, size_t place, typename Ops::V now) {
  const auto rest = Ops::load(b.volume6 + place), zero = Ops::splat(0);
  now = Ops::less(Ops::more(now, Ops::splat(kMinVolume) * rest), Ops::splat(kMaxVolume) * rest);
  const auto pressure = Ops::load(b.bulk + place) * (rest - now);
  const auto lost = Ops::splat(kCollapseBelow) * rest - now;
  if (!Ops::any_above(lost, zero)) return pressure;
  return pressure + Ops::load(b.collapse + place) * Ops::more(lost, zero);
}
// Is one of the cells beyond its limit?
template <class Ops>
DEFORM_INLINE bool any_far(const Block &b, size_t place, typename Ops::V q) {
  return Ops::any_above(q, Ops::splat(b.least_limit)) && Ops::any_above(q, Ops::load(b.limit + place));
}
// Sum of the squares of the six edges.
template <class Ops>
DEFORM_INLINE typename Ops::V squares(const Cells<Ops> &c) {
  const Three<Ops> sum = (c.e1 + c.e2) + c.e3;
  return Ops::splat(4) * ((dot(c.e1, c.e1) + dot(c.e2, c.e2)) + dot(c.e3, c.e3)) - dot(sum, sum);
}
// Share of the volume that counts, and its derivative by the sum of squares q.
template <class Ops>
DEFORM_INLINE typename Ops::V fade(typename Ops::V q, typename Ops::V limit, typename Ops::V &derivative) {
  const auto most = Ops::more(q, limit), u = limit / most, power = Ops::root(u) * u;
  derivative = Ops::splat(-3.75) * (power * (Ops::splat(1) - u)) / most;
  return power * (Ops::splat(2.5) - Ops::splat(1.5) * u);
}
// g becomes the forces of cells of which one at least is beyond its limit; for the others they are pressure *
// g, to the bit.
template <class Ops, class AnyBlock>
DEFORM_INLINE void stretched_forces(const AnyBlock &b, size_t place, typename Ops::V q, typename Ops::V now,
                                    Cells<Ops> &c) {
  typename Ops::V by_q;
  const auto share = fade<Ops>(q, Ops::load(b.limit + place), by_q);
  const auto p = pressure_of<Ops>(b, place, now * share), along = p * share;
  const auto inward = (Ops::splat(8) * p) * (now * by_q);
  const Three<Ops> middle = Ops::splat(0.25) * ((c.e1 + c.e2) + c.e3);
  c.g1 = along * c.g1 + inward * (c.e1 - middle);
  c.g2 = along * c.g2 + inward * (c.e2 - middle);
  c.g3 = along * c.g3 + inward * (c.e3 - middle);
}

// Cells and quads of a large body come from memory as several streams: the processor alone does not run ahead
// of them by as much as an answer takes. A cache line of stiffness is two quads or eight cells.
DEFORM_INLINE void fetch_cells(const Block &b, uint32_t t) {
  lanes::fetch(b.cell + t + 64);
  lanes::fetch(b.volume6 + t + 64);
  lanes::fetch(b.bulk + t + 64);
}

template <class Ops>
DEFORM_INLINE Cells<Ops> gather(const Block &b, uint32_t t) {
  Cells<Ops> c;
  Ops::gather(b, b.cell + t, c.e1, c.e2, c.e3);
  c.g1 = cross(c.e2, c.e3);
  c.g2 = cross(c.e3, c.e1);
  c.g3 = cross(c.e1, c.e2);
  return c;
}

template <class Ops>
static inline void volume_cells(const Block &b) {
  const uint32_t between = b.ahead ? 7 : ~0u;
  for (uint32_t t = 0; t < b.cells; t += Ops::kLanes) {
    if (!(t & between)) fetch_cells(b, t);
    Cells<Ops> c = gather<Ops>(b, t);
    const auto now = dot(c.e1, c.g1), q = squares(c);
    auto pressure = Ops::splat(1);
    if (any_far<Ops>(b, t, q)) {
      stretched_forces(b, t, q, now, c);
    } else {
      pressure = pressure_of<Ops>(b, t, now);
      if (Ops::all_zero(pressure)) continue;
    }
    Ops::spread(b, b.cell + t, pressure, c);
  }
}

// Weighted row sums of the second derivative of a cell's energy, times w_a:
// k g_a sum_b g_b w_b + |p| l sum_{b != a} w_b, with g_a = 6 |dV/dx_a|, and l, the longest edge, for the
// opposite edge that makes each mixed derivative.
template <class Ops>
static inline void cell_rows(const Block &b) {
  typedef typename Ops::V V;
  uint32_t limited = 0;
  for (uint32_t t = 0; t < b.cells; t += Ops::kLanes) {
    const Cell *const cell = b.cell + t;
    const Cells<Ops> c = gather<Ops>(b, t);
    const Three<Ops> a = c.e2 - c.e1, d = c.e3 - c.e2, h = c.e1 - c.e3;
    const V long1 = Ops::more(dot(c.e1, c.e1), dot(c.e2, c.e2)),
            long2 = Ops::more(dot(c.e3, c.e3), dot(a, a));
    const V longest = Ops::root(Ops::more(Ops::more(long1, long2), Ops::more(dot(d, d), dot(h, h))));
    const V limit = Ops::load(b.limit + t), q = squares(c);
    V now = dot(c.e1, c.g1);
    const bool far = Ops::any_above(q, limit);
    if (far) {
      V by_q;
      now = now * fade<Ops>(q, limit, by_q);
    }
    const V pressure = Ops::abs(pressure_of<Ops>(b, t, now)), more = pressure * longest;
    const V k =
        Ops::load(b.bulk + t) + Ops::choose_above(Ops::splat(kCollapseCounted) * Ops::load(b.volume6 + t),
                                                  now, Ops::load(b.collapse + t), Ops::splat(0));
    const Three<Ops> g[4] = {(c.g1 + c.g2) + c.g3, c.g1, c.g2, c.g3};
    alignas(64) double row[4][Ops::kLanes];
    V w[4], n[4];
    for (int m = 0; m < 4; ++m) {
      w[m] = Ops::weights(b, cell, m);
      n[m] = Ops::root(dot(g[m], g[m]));
    }
    const V all = (w[0] + w[1]) + (w[2] + w[3]);
    const V sum = (n[0] * w[0] + n[1] * w[1]) + (n[2] * w[2] + n[3] * w[3]);
    for (int m = 0; m < 4; ++m) Ops::store(row[m], k * (n[m] * sum) + more * (all - w[m]));
    if (far) {
      const V beyond =
          k * (Ops::splat(kFade1) * (limit * limit)) + pressure * (Ops::splat(kFade2) * Ops::root(limit));
      for (int m = 0; m < 4; ++m)
        Ops::store(row[m], Ops::choose_above(q, limit, beyond * w[m], Ops::load(row[m])));
      limited += Ops::count_above(q, limit);
    }
    for (uint32_t i = 0; i < Ops::kLanes; ++i)
      for (int m = 0; m < 4; ++m) b.row[8 * size_t(cell[i].p[m]) + 7] += row[m][i];
  }
  *b.limited = limited;
}

}  // namespace
}  // namespace msm
