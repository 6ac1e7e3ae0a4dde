// The kernels on vectors of four doubles, written once for the files that bring `v4` and its operations
// (model_common/lanes_avx.h, or two registers in model_common/lanes_sse2.h). Everything here has internal
// linkage (see the house rules on wide kernels).
#pragma once
#include "msm_kernel_cells.h"

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

// As fetch_cells.
DEFORM_INLINE void fetch_quads(const Block &b, uint32_t n) {
  fetch(b.quad + n + 48);
  fetch(b.rest + 4 * size_t(n) + 128);
  fetch(b.stiffness + 4 * size_t(n) + 128);
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

// Four cells at a time.
struct Four : Wide {
  static constexpr uint32_t kLanes = 4;
  DEFORM_INLINE v4 load(const double *p) { return load4(p); }
  DEFORM_INLINE void store(double *p, v4 a) { store4(p, a); }
  DEFORM_INLINE v4 abs(v4 a) { return abs4(a); }
  DEFORM_INLINE bool any_above(v4 a, v4 limit) { return lanes::any_above(a, limit); }
  DEFORM_INLINE uint32_t count_above(v4 a, v4 limit) { return lanes::count_above(a, limit); }
  DEFORM_INLINE v4 choose_above(v4 a, v4 limit, v4 above, v4 below) {
    return lanes::choose_above(a, limit, above, below);
  }
  DEFORM_INLINE bool all_zero(v4 a) { return lanes::all_zero(a); }
  DEFORM_INLINE v4 weights(const Block &b, const Cell *c, int n) {
    return set4(b.weight[c[0].p[n]], b.weight[c[1].p[n]], b.weight[c[2].p[n]], b.weight[c[3].p[n]]);
  }
  DEFORM_INLINE void gather(const Block &b, const Cell *c, Three<Four> &e1, Three<Four> &e2,
                            Three<Four> &e3) {
    const v4 o0 = point4(b, c[0].p[0]), o1 = point4(b, c[1].p[0]);
    const v4 o2 = point4(b, c[2].p[0]), o3 = point4(b, c[3].p[0]);
    const auto edges = [&](int n, Three<Four> &e) __attribute__((always_inline)) {
      v4 unused = point4(b, c[3].p[n]) - o3;
      e = {point4(b, c[0].p[n]) - o0, point4(b, c[1].p[n]) - o1, point4(b, c[2].p[n]) - o2};
      transpose(e.x, e.y, e.z, unused);
    };
    edges(1, e1);
    edges(2, e2);
    edges(3, e3);
  }
  // Adds pressure * g to the corners of the cells, corner after corner.
  DEFORM_INLINE void spread(const Block &b, const Cell *c, v4 pressure, const Cells<Four> &cells) {
    v4 sum[4];
    const auto corner = [&](int n, const Three<Four> &g) __attribute__((always_inline)) {
      v4 f[4] = {pressure * g.x, pressure * g.y, pressure * g.z, lanes::splat(0)};
      transpose(f[0], f[1], f[2], f[3]);
      for (int k = 0; k < 4; ++k) {
        add_to(b, c[k].p[n], f[k]);
        sum[k] = n == 1 ? f[k] : sum[k] + f[k];
      }
    };
    corner(1, cells.g1);
    corner(2, cells.g2);
    corner(3, cells.g3);
    for (int k = 0; k < 4; ++k) take_from(b, c[k].p[0], sum[k]);
  }
};

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
#define MSM_ROWS {spring_rows<kPlain>, spring_rows<kTilted>, spring_rows<kTurned>}, cell_rows<Four>

static inline void merge_rows(double *row, const Merge *merge, uint32_t n) { merge_lanes<8>(row, merge, n); }

}  // namespace
}  // namespace msm
