// The kernels on vectors of four doubles, written once for the files that bring `v4` and its operations
// (model_common/lanes_avx.h, or two registers in model_common/lanes_sse2.h). Everything here has internal
// linkage (see the house rules on wide kernels).
#pragma once
#include <stddef.h>

#include "../model_common/block_lanes.h"
#include "msm_kernel.h"

namespace msm {
namespace {

using namespace lanes;

DEFORM_INLINE void take_from(const model::BlockPoints &b, uint32_t n, v4 a) {
  double *f = b.f + 4 * size_t(n);
  store4(f, load4(f) - a);
}

template <Damping kDamping>
DEFORM_INLINE v4 damp4(const Block &b, uint32_t n, double damp) {
  if constexpr (kDamping == kPerSpring) return load4(b.damp + 4 * size_t(n));
  else return splat(damp);
}
DEFORM_INLINE v4 rates(const Block &b, const Quad &q, v4 d0, v4 d1, v4 d2, v4 d3) {
  const v4 vi = velocity4(b, q.i);
  return sum_rows(d0 * (velocity4(b, q.j[0]) - vi), d1 * (velocity4(b, q.j[1]) - vi),
                  d2 * (velocity4(b, q.j[2]) - vi), d3 * (velocity4(b, q.j[3]) - vi));
}
DEFORM_INLINE void spread_springs(const Block &b, const Quad &q, v4 scale, v4 d0, v4 d1, v4 d2, v4 d3) {
  const v4 f0 = lane<0>(scale) * d0;
  const v4 f1 = lane<1>(scale) * d1;
  const v4 f2 = lane<2>(scale) * d2;
  const v4 f3 = lane<3>(scale) * d3;
  add_to(b, q.i, (f0 + f1) + (f2 + f3));
  take_from(b, q.j[0], f0);
  take_from(b, q.j[1], f1);
  take_from(b, q.j[2], f2);
  take_from(b, q.j[3], f3);
}

// Quads and cells of a large body come from memory as several streams: the processor alone does not run ahead
// of them by as much as an answer takes. A cache line of stiffness is two quads or eight cells.
DEFORM_INLINE void fetch_quads(const Block &b, uint32_t n) {
  fetch(b.quad + n + 48);
  fetch(b.rest + 4 * size_t(n) + 128);
  fetch(b.stiffness + 4 * size_t(n) + 128);
}
DEFORM_INLINE void fetch_cells(const Block &b, uint32_t t) {
  fetch(b.cell + t + 64);
  fetch(b.volume6 + t + 64);
  fetch(b.bulk + t + 64);
}

template <Form kForm, Damping kDamping>
static inline void springs(const Block &b, double damp) {
  const uint32_t between = b.ahead ? 1 : ~0u;
  for (uint32_t n = 0; n < b.quads; ++n) {
    const Quad &q = b.quad[n];
    if (!(n & between)) fetch_quads(b, n);
    const v4 xi = point4(b, q.i);
    const v4 d0 = point4(b, q.j[0]) - xi;
    const v4 d1 = point4(b, q.j[1]) - xi;
    const v4 d2 = point4(b, q.j[2]) - xi;
    const v4 d3 = point4(b, q.j[3]) - xi;
    const v4 dd = sum_rows(d0 * d0, d1 * d1, d2 * d2, d3 * d3), rest = load4(b.rest + 4 * size_t(n));
    v4 stretch;
    if constexpr (kForm == kTurned) {
      const v4 length = sqrt4(dd + load4(b.tilt + 4 * size_t(n)));
      const v4 inverse = splat(1.0) / (sqrt4(dd) * length);
      stretch = (length - rest) * (inverse * length);
      if constexpr (kDamping != kUndamped)
        stretch = stretch + damp4<kDamping>(b, n, damp) * (rates(b, q, d0, d1, d2, d3) * inverse);
    } else {
      const v4 length = sqrt4(kForm == kTilted ? dd + load4(b.tilt + 4 * size_t(n)) : dd);
      const v4 inverse = splat(1.0) / length;
      stretch = (length - rest) * inverse;
      if constexpr (kDamping != kUndamped)
        stretch = stretch + damp4<kDamping>(b, n, damp) * ((rates(b, q, d0, d1, d2, d3) * inverse) * inverse);
    }
    const v4 scale =
        zero_unless_above(load4(b.stiffness + 4 * size_t(n)) * stretch, dd, splat(kShortestSquared));
    spread_springs(b, q, scale, d0, d1, d2, d3);
  }
}

template <Damping kDamping>
static inline void branches(const Block &b, double damp, const Branch &branch) {
  for (uint32_t n = 0; n < b.quads; ++n) {
    const Quad &q = b.quad[n];
    const v4 xi = point4(b, q.i);
    const v4 d0 = point4(b, q.j[0]) - xi;
    const v4 d1 = point4(b, q.j[1]) - xi;
    const v4 d2 = point4(b, q.j[2]) - xi;
    const v4 d3 = point4(b, q.j[3]) - xi;
    const v4 dd = sum_rows(d0 * d0, d1 * d1, d2 * d2, d3 * d3);
    const v4 length = sqrt4(dd + load4(b.tilt + 4 * size_t(n))), inverse = splat(1.0) / length;
    const uint32_t *edge = b.edge + 4 * size_t(n);
    const auto state = [&](int k) __attribute__((always_inline)) {
      return edge[k] == ~0u ? 0.0 : branch.state[edge[k]];
    };
    const v4 more = length - load4(b.rest + 4 * size_t(n)), r = set4(state(0), state(1), state(2), state(3));
    v4 stretch = (splat(branch.follow) * more + splat(branch.part) * r) * inverse;
    if constexpr (kDamping != kUndamped)
      stretch = stretch + damp4<kDamping>(b, n, damp) * ((rates(b, q, d0, d1, d2, d3) * inverse) * inverse);
    const v4 scale =
        zero_unless_above(load4(b.stiffness + 4 * size_t(n)) * stretch, dd, splat(kShortestSquared));
    spread_springs(b, q, scale, d0, d1, d2, d3);
    if (!branch.state_out) continue;
    alignas(32) double next[4];
    store4(next, splat(branch.keep) * (r + splat(branch.kept) * more) - splat(branch.next) * more);
    for (int k = 0; k < 4; ++k)
      if (edge[k] != ~0u) branch.state_out[edge[k]] = next[k];
  }
}

// Edges of four cells from their first corner to corner n, by component.
struct Edges4 { v4 x, y, z; };
DEFORM_INLINE void gather_edges(const Block &b, const Cell *c, int n, v4 o0, v4 o1, v4 o2, v4 o3,
                                Edges4 &out) {
  v4 unused = point4(b, c[3].p[n]) - o3;
  out.x = point4(b, c[0].p[n]) - o0;
  out.y = point4(b, c[1].p[n]) - o1;
  out.z = point4(b, c[2].p[n]) - o2;
  transpose(out.x, out.y, out.z, unused);
}
DEFORM_INLINE void gather_all(const Block &b, const Cell *c, Edges4 &e1, Edges4 &e2, Edges4 &e3) {
  const v4 o0 = point4(b, c[0].p[0]);
  const v4 o1 = point4(b, c[1].p[0]);
  const v4 o2 = point4(b, c[2].p[0]);
  const v4 o3 = point4(b, c[3].p[0]);
  gather_edges(b, c, 1, o0, o1, o2, o3, e1);
  gather_edges(b, c, 2, o0, o1, o2, o3, e2);
  gather_edges(b, c, 3, o0, o1, o2, o3, e3);
}
DEFORM_INLINE void cross(const Edges4 &a, const Edges4 &b, Edges4 &out) {
  out.x = a.y * b.z - a.z * b.y;
  out.y = a.z * b.x - a.x * b.z;
  out.z = a.x * b.y - a.y * b.x;
}
DEFORM_INLINE v4 dot(const Edges4 &a, const Edges4 &b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }
// Adds pressure * g to corner n of the four cells and hands the four forces back.
DEFORM_INLINE void spread(const Block &b, const Cell *c, int n, v4 pressure, const Edges4 &g, v4 &f0, v4 &f1,
                          v4 &f2, v4 &f3) {
  f0 = pressure * g.x;
  f1 = pressure * g.y;
  f2 = pressure * g.z;
  f3 = splat(0);
  transpose(f0, f1, f2, f3);
  add_to(b, c[0].p[n], f0);
  add_to(b, c[1].p[n], f1);
  add_to(b, c[2].p[n], f2);
  add_to(b, c[3].p[n], f3);
}

DEFORM_INLINE v4 pressure_of(const Block &b, uint32_t t, v4 now) {
  const v4 rest = load4(b.volume6 + t);
  now = min4(max4(now, splat(kMinVolume) * rest), splat(kMaxVolume) * rest);
  const v4 pressure = load4(b.bulk + t) * (rest - now), lost = splat(kCollapseBelow) * rest - now;
  return any_above(lost, splat(0)) ? pressure + load4(b.collapse + t) * max4(lost, splat(0)) : pressure;
}
// Is one of four cells beyond its limit?
DEFORM_INLINE bool any_far(const Block &b, uint32_t t, v4 q) {
  return any_above(q, splat(b.least_limit)) && any_above(q, load4(b.limit + t));
}
// Sum of the squares of the six edges.
DEFORM_INLINE v4 squares(const Edges4 &e1, const Edges4 &e2, const Edges4 &e3) {
  const Edges4 sum = {(e1.x + e2.x) + e3.x, (e1.y + e2.y) + e3.y, (e1.z + e2.z) + e3.z};
  return splat(4) * ((dot(e1, e1) + dot(e2, e2)) + dot(e3, e3)) - dot(sum, sum);
}
// Share of the volume that counts, and its derivative by the sum of squares q.
DEFORM_INLINE v4 fade(v4 q, v4 limit, v4 &derivative) {
  const v4 most = max4(q, limit), u = limit / most, power = sqrt4(u) * u;
  derivative = splat(-3.75) * (power * (splat(1) - u)) / most;
  return power * (splat(2.5) - splat(1.5) * u);
}
// Forces of four cells of which one at least is beyond its limit; for the others they are pressure *
// g, to the bit.
DEFORM_INLINE void stretched_forces(const Block &b, uint32_t t, v4 q, v4 now, const Edges4 &e1,
                                    const Edges4 &e2, const Edges4 &e3, Edges4 &g1, Edges4 &g2, Edges4 &g3) {
  v4 by_q;
  const v4 share = fade(q, load4(b.limit + t), by_q), p = pressure_of(b, t, now * share);
  const v4 along = p * share, inward = (splat(8) * p) * (now * by_q), quarter = splat(0.25);
  const Edges4 middle = {quarter * ((e1.x + e2.x) + e3.x), quarter * ((e1.y + e2.y) + e3.y),
                         quarter * ((e1.z + e2.z) + e3.z)};
  const auto turn = [&](const Edges4 &e, Edges4 &g) __attribute__((always_inline)) {
    g.x = along * g.x + inward * (e.x - middle.x);
    g.y = along * g.y + inward * (e.y - middle.y);
    g.z = along * g.z + inward * (e.z - middle.z);
  };
  turn(e1, g1);
  turn(e2, g2);
  turn(e3, g3);
}

static inline void volume_cells(const Block &b) {
  const uint32_t between = b.ahead ? 7 : ~0u;
  for (uint32_t t = 0; t < b.cells; t += 4) {
    if (!(t & between)) fetch_cells(b, t);
    const Cell *c = b.cell + t;
    Edges4 e1, e2, e3, g1, g2, g3;
    gather_all(b, c, e1, e2, e3);
    cross(e2, e3, g1);
    cross(e3, e1, g2);
    cross(e1, e2, g3);
    const v4 now = dot(e1, g1), q = squares(e1, e2, e3);
    v4 pressure = splat(1);
    if (any_far(b, t, q)) {
      stretched_forces(b, t, q, now, e1, e2, e3, g1, g2, g3);
    } else {
      pressure = pressure_of(b, t, now);
      if (all_zero(pressure)) continue;
    }
    v4 s0, s1, s2, s3, f0, f1, f2, f3;
    spread(b, c, 1, pressure, g1, s0, s1, s2, s3);
    spread(b, c, 2, pressure, g2, f0, f1, f2, f3);
    s0 = s0 + f0;
    s1 = s1 + f1;
    s2 = s2 + f2;
    s3 = s3 + f3;
    spread(b, c, 3, pressure, g3, f0, f1, f2, f3);
    s0 = s0 + f0;
    s1 = s1 + f1;
    s2 = s2 + f2;
    s3 = s3 + f3;
    take_from(b, c[0].p[0], s0);
    take_from(b, c[1].p[0], s1);
    take_from(b, c[2].p[0], s2);
    take_from(b, c[3].p[0], s3);
  }
}

DEFORM_INLINE v4 weights(const Block &b, const Cell *c, int n) {
  return set4(b.weight[c[0].p[n]], b.weight[c[1].p[n]], b.weight[c[2].p[n]], b.weight[c[3].p[n]]);
}
// Weighted row sums of the second derivative of a cell's energy, times w_a:
// k g_a sum_b g_b w_b + |p| l sum_{b != a} w_b, with g_a = 6 |dV/dx_a|, and l, the longest edge, for the
// opposite edge that makes each mixed derivative.
static inline void cell_rows(const Block &b) {
  uint32_t limited = 0;
  for (uint32_t t = 0; t < b.cells; t += 4) {
    const Cell *c = b.cell + t;
    Edges4 e1, e2, e3, g1, g2, g3;
    gather_all(b, c, e1, e2, e3);
    cross(e2, e3, g1);
    cross(e3, e1, g2);
    cross(e1, e2, g3);
    const Edges4 g0 = {(g1.x + g2.x) + g3.x, (g1.y + g2.y) + g3.y, (g1.z + g2.z) + g3.z};
    const Edges4 a = {e2.x - e1.x, e2.y - e1.y, e2.z - e1.z}, d = {e3.x - e2.x, e3.y - e2.y, e3.z - e2.z};
    const Edges4 h = {e1.x - e3.x, e1.y - e3.y, e1.z - e3.z};
    const v4 longest = sqrt4(
        max4(max4(max4(dot(e1, e1), dot(e2, e2)), max4(dot(e3, e3), dot(a, a))), max4(dot(d, d), dot(h, h))));
    const v4 limit = load4(b.limit + t), q = squares(e1, e2, e3);
    v4 now = dot(e1, g1);
    const bool far = any_above(q, limit);
    if (far) {
      v4 by_q;
      now = now * fade(q, limit, by_q);
    }
    const v4 pressure = abs4(pressure_of(b, t, now));
    const v4 more = pressure * longest;
    const v4 k = load4(b.bulk + t) + zero_unless_above(load4(b.collapse + t),
                                                       splat(kCollapseCounted) * load4(b.volume6 + t), now);
    alignas(32) double row[4][4];
    const v4 w0 = weights(b, c, 0);
    const v4 w1 = weights(b, c, 1);
    const v4 w2 = weights(b, c, 2);
    const v4 w3 = weights(b, c, 3);
    const v4 w = (w0 + w1) + (w2 + w3);
    const v4 n0 = sqrt4(dot(g0, g0));
    const v4 n1 = sqrt4(dot(g1, g1));
    const v4 n2 = sqrt4(dot(g2, g2));
    const v4 n3 = sqrt4(dot(g3, g3));
    const v4 sum = (n0 * w0 + n1 * w1) + (n2 * w2 + n3 * w3);
    const auto store = [&](int corner, v4 own, v4 weight) __attribute__((always_inline)) {
      store4(row[corner], k * (own * sum) + more * (w - weight));
    };
    store(0, n0, w0);
    store(1, n1, w1);
    store(2, n2, w2);
    store(3, n3, w3);
    if (far) {
      const v4 beyond = k * (splat(kFade1) * (limit * limit)) + pressure * (splat(kFade2) * sqrt4(limit));
      const v4 weight[4] = {w0, w1, w2, w3};
      for (int n = 0; n < 4; ++n) store4(row[n], choose_above(q, limit, beyond * weight[n], load4(row[n])));
      limited += count_above(q, limit);
    }
    for (int n = 0; n < 4; ++n)
      for (int m = 0; m < 4; ++m) b.row[8 * size_t(c[n].p[m]) + 7] += row[m][n];
  }
  *b.limited = limited;
}

// Diagonal blocks of the springs' stiffness, k ((1 - s) d d^T/L^2 + s I) with s = max(0, 1 - L0/L): a
// compressed spring is counted without its softening. Where the length counts more than d (kTilted, kTurned)
// the block's norm follows the shape, and so does the coupling, norm w_other / w_own, in the lane that is
// left. kTurned: k (l/L n n^T + s (I - n n^T)) with s = max(0, L - L0)/l.
template <Form kForm>
static inline void spring_rows(const Block &b) {
  for (uint32_t n = 0; n < b.local; ++n) {
    store4(b.row + 8 * size_t(n), splat(0));
    store4(b.row + 8 * size_t(n) + 4, splat(0));
  }
  const auto add = [&b](uint32_t n, v4 square, v4 mixed) __attribute__((always_inline)) {
    double *row = b.row + 8 * size_t(n);
    store4(row, load4(row) + square);
    store4(row + 4, load4(row + 4) + mixed);
  };
  const v4 diagonal = set4(1, 1, 1, kForm == kPlain ? 1 : 0);
  for (uint32_t n = 0; n < b.quads; ++n) {
    const Quad &q = b.quad[n];
    const v4 xi = point4(b, q.i);
    const v4 d0 = point4(b, q.j[0]) - xi;
    const v4 d1 = point4(b, q.j[1]) - xi;
    const v4 d2 = point4(b, q.j[2]) - xi;
    const v4 d3 = point4(b, q.j[3]) - xi;
    const v4 dd = sum_rows(d0 * d0, d1 * d1, d2 * d2, d3 * d3);
    const v4 length = sqrt4(kForm == kPlain ? dd : dd + load4(b.tilt + 4 * size_t(n)));
    const v4 k = load4(b.stiffness + 4 * size_t(n));
    const v4 least = splat(kShortestSquared);
    const v4 rest = load4(b.rest + 4 * size_t(n));
    v4 straight, all, along;
    if constexpr (kForm == kTurned) {
      const v4 short_length = sqrt4(dd), inverse = splat(1.0) / (short_length * length);
      all = zero_unless_above(k * (max4(length - rest, splat(0)) * (inverse * length)), dd, least);
      straight = zero_unless_above(k * ((short_length * short_length) * inverse), dd, least) - all;
      along = zero_unless_above(straight / dd, dd, least);
    } else {
      const v4 inverse = splat(1.0) / length;
      const v4 turned = max4((length - rest) * inverse, splat(0));
      straight = zero_unless_above(k - k * turned, dd, least);
      all = k - straight;
      along = zero_unless_above((straight * inverse) * inverse, dd, least);
    }
    const v4 o0 = lane<0>(along) * d0;
    const v4 o1 = lane<1>(along) * d1;
    const v4 o2 = lane<2>(along) * d2;
    const v4 o3 = lane<3>(along) * d3;
    v4 a0 = lane<0>(all), a1 = lane<1>(all), a2 = lane<2>(all), a3 = lane<3>(all);
    if constexpr (kForm != kPlain) {
      a0 = a0 * diagonal;
      a1 = a1 * diagonal;
      a2 = a2 * diagonal;
      a3 = a3 * diagonal;
    }
    const v4 s0 = o0 * d0 + a0, s1 = o1 * d1 + a1, s2 = o2 * d2 + a2, s3 = o3 * d3 + a3;
    const v4 m0 = o0 * yzx(d0), m1 = o1 * yzx(d1), m2 = o2 * yzx(d2), m3 = o3 * yzx(d3);
    add(q.i, (s0 + s1) + (s2 + s3), (m0 + m1) + (m2 + m3));
    add(q.j[0], s0, m0);
    add(q.j[1], s1, m1);
    add(q.j[2], s2, m2);
    add(q.j[3], s3, m3);
    if constexpr (kForm != kPlain) {
      alignas(32) double norm[4];
      store4(norm, max4(along * dd + all, all));
      const double w = b.weight[q.i];
      for (int m = 0; m < 4; ++m) {
        const double ratio = b.weight[q.j[m]] / w;
        b.row[8 * size_t(q.i) + 3] += norm[m] * ratio;
        b.row[8 * size_t(q.j[m]) + 3] += norm[m] / ratio;
      }
    }
  }
}

// The entries that every instruction set shares.
#define MSM_BRANCHES {branches<kUndamped>, branches<kUniform>, branches<kPerSpring>}
#define MSM_SPRINGS(f)                                                         \
  {f<kPlain, kUndamped>, f<kPlain, kUniform>, f<kPlain, kPerSpring>},          \
      {f<kTilted, kUndamped>, f<kTilted, kUniform>, f<kTilted, kPerSpring>}, { \
    f<kTurned, kUndamped>, f<kTurned, kUniform>, f<kTurned, kPerSpring>        \
  }
#define MSM_ROWS {spring_rows<kPlain>, spring_rows<kTilted>, spring_rows<kTurned>}, cell_rows

static inline void merge_rows(double *row, const Merge *merge, uint32_t n) { merge_lanes<8>(row, merge, n); }

}  // namespace
}  // namespace msm
