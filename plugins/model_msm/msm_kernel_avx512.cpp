// Vectors of eight. A point with its velocity is one load; two quads of springs, or eight cells, share each
// root and each division. Sums per point run in the order of the other kernels: first quad, then second;
// cell after cell.
#include "../model_common/lanes_avx.h"

#define DEFORM_LANES 8  // registers of 16 take longer: the sums per point, in double, have half their ports
#include "msm_kernel_energy.h"
#include "msm_kernel_single.h"

namespace msm {
namespace {

DEFORM_INLINE __m512d point8(const Block &b, uint32_t n) { return _mm512_load_pd(b.p + 8 * size_t(n)); }
DEFORM_INLINE __m256d low(__m512d a) { return _mm512_castpd512_pd256(a); }
DEFORM_INLINE __m256d high(__m512d a) { return _mm512_extractf64x4_pd(a, 1); }
// In each half: out[k] = (s_k.x + s_k.y) + (s_k.z + s_k.w)
DEFORM_INLINE __m512d sum_rows(__m512d s0, __m512d s1, __m512d s2, __m512d s3) {
  const __m512d a = _mm512_add_pd(_mm512_unpacklo_pd(s0, s1), _mm512_unpackhi_pd(s0, s1));
  const __m512d b = _mm512_add_pd(_mm512_unpacklo_pd(s2, s3), _mm512_unpackhi_pd(s2, s3));
  const __m512i lo = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
  const __m512i hi = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
  return _mm512_add_pd(_mm512_permutex2var_pd(a, lo, b), _mm512_permutex2var_pd(a, hi, b));
}

// [d | e] -> [d d | d e], the terms of d.d and of d.e
DEFORM_INLINE __m512d products(__m512d de) { return _mm512_mul_pd(_mm512_shuffle_f64x2(de, de, 0x44), de); }

// Forces of four springs to their points; lane kFirst + k of scale belongs to spring k.
template <int kFirst>
DEFORM_INLINE void spread(const Block &b, const Quad &q, __m512d scale, __m512d d0, __m512d d1, __m512d d2,
                          __m512d d3) {
  const __m256d f0 = _mm256_mul_pd(low(_mm512_permutexvar_pd(_mm512_set1_epi64(kFirst), scale)), low(d0));
  const __m256d f1 = _mm256_mul_pd(low(_mm512_permutexvar_pd(_mm512_set1_epi64(kFirst + 1), scale)), low(d1));
  const __m256d f2 = _mm256_mul_pd(low(_mm512_permutexvar_pd(_mm512_set1_epi64(kFirst + 2), scale)), low(d2));
  const __m256d f3 = _mm256_mul_pd(low(_mm512_permutexvar_pd(_mm512_set1_epi64(kFirst + 3), scale)), low(d3));
  add_to(b, q.i, _mm256_add_pd(_mm256_add_pd(f0, f1), _mm256_add_pd(f2, f3)));
  take_from(b, q.j[0], f0);
  take_from(b, q.j[1], f1);
  take_from(b, q.j[2], f2);
  take_from(b, q.j[3], f3);
}

template <Form kForm, Damping kDamping>
static void springs8(const Block &b, double damp) {
  for (uint32_t n = 0; n < b.quads; n += 2) {
    const Quad &q = b.quad[n], &r = b.quad[n + 1];
    if (b.ahead) fetch_quads(b, n);
    const __m512d pq = point8(b, q.i), pr = point8(b, r.i);
    const __m512d d0 = _mm512_sub_pd(point8(b, q.j[0]), pq), d1 = _mm512_sub_pd(point8(b, q.j[1]), pq);
    const __m512d d2 = _mm512_sub_pd(point8(b, q.j[2]), pq), d3 = _mm512_sub_pd(point8(b, q.j[3]), pq);
    const __m512d d4 = _mm512_sub_pd(point8(b, r.j[0]), pr), d5 = _mm512_sub_pd(point8(b, r.j[1]), pr);
    const __m512d d6 = _mm512_sub_pd(point8(b, r.j[2]), pr), d7 = _mm512_sub_pd(point8(b, r.j[3]), pr);
    const __m512d s = sum_rows(products(d0), products(d1), products(d2), products(d3));
    const __m512d t = sum_rows(products(d4), products(d5), products(d6), products(d7));
    const __m512d dd = _mm512_shuffle_f64x2(s, t, 0x44);
    const __m512d counted = kForm == kPlain ? dd : _mm512_add_pd(dd, _mm512_load_pd(b.tilt + 4 * size_t(n)));
    const __m512d length = _mm512_sqrt_pd(counted);
    const __m512d more = _mm512_sub_pd(length, _mm512_load_pd(b.rest + 4 * size_t(n)));
    // 1/L, or 1/(l L) where the force turns back into the body (kTurned).
    const __m512d inverse = _mm512_div_pd(
        _mm512_set1_pd(1.0), kForm == kTurned ? _mm512_mul_pd(_mm512_sqrt_pd(dd), length) : length);
    __m512d stretch = _mm512_mul_pd(more, kForm == kTurned ? _mm512_mul_pd(inverse, length) : inverse);
    if constexpr (kDamping != kUndamped) {
      const __m512d factor =
          kDamping == kPerSpring ? _mm512_load_pd(b.damp + 4 * size_t(n)) : _mm512_set1_pd(damp);
      const __m512d rate = _mm512_mul_pd(_mm512_shuffle_f64x2(s, t, 0xee), inverse);
      stretch = _mm512_add_pd(stretch,
                              _mm512_mul_pd(factor, kForm == kTurned ? rate : _mm512_mul_pd(rate, inverse)));
    }
    const __mmask8 has_direction = _mm512_cmp_pd_mask(dd, _mm512_set1_pd(kShortestSquared), _CMP_GT_OQ);
    const __m512d scale =
        _mm512_maskz_mul_pd(has_direction, _mm512_load_pd(b.stiffness + 4 * size_t(n)), stretch);
    spread<0>(b, q, scale, d0, d1, d2, d3);
    spread<4>(b, r, scale, d4, d5, d6, d7);
  }
}

// Transposes the 4 x 4 of each half.
DEFORM_INLINE void transpose(__m512d &r0, __m512d &r1, __m512d &r2, __m512d &r3) {
  const __m512d a = _mm512_unpacklo_pd(r0, r1), b = _mm512_unpackhi_pd(r0, r1);
  const __m512d c = _mm512_unpacklo_pd(r2, r3), d = _mm512_unpackhi_pd(r2, r3);
  const __m512i lo = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
  const __m512i hi = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
  r0 = _mm512_permutex2var_pd(a, lo, c);
  r1 = _mm512_permutex2var_pd(b, lo, d);
  r2 = _mm512_permutex2var_pd(a, hi, c);
  r3 = _mm512_permutex2var_pd(b, hi, d);
}

// Corner n of cells k and k + 4.
DEFORM_INLINE __m512d corner(const Block &b, const Cell *c, int k, int n) {
  return _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_load_pd(b.p + 8 * size_t(c[k].p[n]))),
                            _mm256_load_pd(b.p + 8 * size_t(c[k + 4].p[n])), 1);
}

struct Edges8 { __m512d x, y, z; };
DEFORM_INLINE void gather_edges(const Block &b, const Cell *c, int n, __m512d o0, __m512d o1, __m512d o2,
                                __m512d o3, Edges8 &out) {
  out.x = _mm512_sub_pd(corner(b, c, 0, n), o0);
  out.y = _mm512_sub_pd(corner(b, c, 1, n), o1);
  out.z = _mm512_sub_pd(corner(b, c, 2, n), o2);
  __m512d unused = _mm512_sub_pd(corner(b, c, 3, n), o3);
  transpose(out.x, out.y, out.z, unused);
}
DEFORM_INLINE __m512d minor2(__m512d a, __m512d b, __m512d c, __m512d d) {
  return _mm512_sub_pd(_mm512_mul_pd(a, b), _mm512_mul_pd(c, d));
}
DEFORM_INLINE void cross(const Edges8 &a, const Edges8 &b, Edges8 &out) {
  out.x = minor2(a.y, b.z, a.z, b.y);
  out.y = minor2(a.z, b.x, a.x, b.z);
  out.z = minor2(a.x, b.y, a.y, b.x);
}

// Of eight cells: edges from their first corners, and for each the vector product of the other two.
struct Shape8 { Edges8 e1, e2, e3, g1, g2, g3; };
DEFORM_INLINE Shape8 shape8(const Block &b, const Cell *c) {
  const __m512d o0 = corner(b, c, 0, 0), o1 = corner(b, c, 1, 0), o2 = corner(b, c, 2, 0),
                o3 = corner(b, c, 3, 0);
  Shape8 s;
  gather_edges(b, c, 1, o0, o1, o2, o3, s.e1);
  gather_edges(b, c, 2, o0, o1, o2, o3, s.e2);
  gather_edges(b, c, 3, o0, o1, o2, o3, s.e3);
  cross(s.e2, s.e3, s.g1);
  cross(s.e3, s.e1, s.g2);
  cross(s.e1, s.e2, s.g3);
  return s;
}

struct Forces { __m512d f0, f1, f2, f3; };  // of cells k and k + 4 at one corner
DEFORM_INLINE void forces_at(__m512d pressure, const Edges8 &g, Forces &f) {
  f.f0 = _mm512_mul_pd(pressure, g.x);
  f.f1 = _mm512_mul_pd(pressure, g.y);
  f.f2 = _mm512_mul_pd(pressure, g.z);
  f.f3 = _mm512_setzero_pd();
  transpose(f.f0, f.f1, f.f2, f.f3);
}
DEFORM_INLINE void add(Forces &a, const Forces &b) {
  a.f0 = _mm512_add_pd(a.f0, b.f0);
  a.f1 = _mm512_add_pd(a.f1, b.f1);
  a.f2 = _mm512_add_pd(a.f2, b.f2);
  a.f3 = _mm512_add_pd(a.f3, b.f3);
}
// One cell after the other at each corner, corners 1 2 3 0, four cells at a time: the order of the
// other kernels.
DEFORM_INLINE void spread_low(const Block &b, const Cell *c, int n, const Forces &f) {
  add_to(b, c[0].p[n], low(f.f0));
  add_to(b, c[1].p[n], low(f.f1));
  add_to(b, c[2].p[n], low(f.f2));
  add_to(b, c[3].p[n], low(f.f3));
}
DEFORM_INLINE void spread_high(const Block &b, const Cell *c, int n, const Forces &f) {
  add_to(b, c[4].p[n], high(f.f0));
  add_to(b, c[5].p[n], high(f.f1));
  add_to(b, c[6].p[n], high(f.f2));
  add_to(b, c[7].p[n], high(f.f3));
}

DEFORM_INLINE __m512d dot(const Edges8 &a, const Edges8 &b) {
  return _mm512_add_pd(_mm512_add_pd(_mm512_mul_pd(a.x, b.x), _mm512_mul_pd(a.y, b.y)),
                       _mm512_mul_pd(a.z, b.z));
}
DEFORM_INLINE __m512d sum3(__m512d a, __m512d b, __m512d c) { return _mm512_add_pd(_mm512_add_pd(a, b), c); }
DEFORM_INLINE Edges8 sum3(const Edges8 &a, const Edges8 &b, const Edges8 &c) {
  return {sum3(a.x, b.x, c.x), sum3(a.y, b.y, c.y), sum3(a.z, b.z, c.z)};
}
DEFORM_INLINE __m512d pressure_of(const Block &b, uint32_t t, __m512d now) {
  const __m512d rest = _mm512_load_pd(b.volume6 + t);
  const __m512d below = _mm512_mul_pd(_mm512_set1_pd(kCollapseBelow), rest);
  now = _mm512_max_pd(now, _mm512_mul_pd(_mm512_set1_pd(kMinVolume), rest));
  now = _mm512_min_pd(now, _mm512_mul_pd(_mm512_set1_pd(kMaxVolume), rest));
  const __m512d pressure = _mm512_mul_pd(_mm512_load_pd(b.bulk + t), _mm512_sub_pd(rest, now));
  if (!_mm512_cmp_pd_mask(below, now, _CMP_GT_OQ)) return pressure;
  const __m512d lost = _mm512_max_pd(_mm512_sub_pd(below, now), _mm512_setzero_pd());
  return _mm512_add_pd(pressure, _mm512_mul_pd(_mm512_load_pd(b.collapse + t), lost));
}
DEFORM_INLINE bool any_far(const Block &b, uint32_t t, __m512d q) {
  return _mm512_cmp_pd_mask(q, _mm512_set1_pd(b.least_limit), _CMP_GT_OQ) &&
         _mm512_cmp_pd_mask(q, _mm512_load_pd(b.limit + t), _CMP_GT_OQ);
}
DEFORM_INLINE __m512d squares(const Edges8 &e1, const Edges8 &e2, const Edges8 &e3) {
  const Edges8 sum = sum3(e1, e2, e3);
  return _mm512_sub_pd(_mm512_mul_pd(_mm512_set1_pd(4), sum3(dot(e1, e1), dot(e2, e2), dot(e3, e3))),
                       dot(sum, sum));
}
DEFORM_INLINE __m512d fade(__m512d q, __m512d limit, __m512d &by_q) {
  const __m512d most = _mm512_max_pd(q, limit);
  const __m512d u = _mm512_div_pd(limit, most);
  const __m512d one = _mm512_set1_pd(1);
  const __m512d power = _mm512_mul_pd(_mm512_sqrt_pd(u), u);
  by_q =
      _mm512_div_pd(_mm512_mul_pd(_mm512_set1_pd(-3.75), _mm512_mul_pd(power, _mm512_sub_pd(one, u))), most);
  return _mm512_mul_pd(power, _mm512_sub_pd(_mm512_set1_pd(2.5), _mm512_mul_pd(_mm512_set1_pd(1.5), u)));
}
DEFORM_INLINE void stretched_forces(const Block &b, uint32_t t, __m512d q, __m512d now, const Edges8 &e1,
                                    const Edges8 &e2, const Edges8 &e3, Edges8 &g1, Edges8 &g2, Edges8 &g3) {
  __m512d by_q;
  const __m512d share = fade(q, _mm512_load_pd(b.limit + t), by_q);
  const __m512d p = pressure_of(b, t, _mm512_mul_pd(now, share));
  const __m512d along = _mm512_mul_pd(p, share);
  const __m512d quarter = _mm512_set1_pd(0.25);
  const __m512d inward = _mm512_mul_pd(_mm512_mul_pd(_mm512_set1_pd(8), p), _mm512_mul_pd(now, by_q));
  const Edges8 sum = sum3(e1, e2, e3);
  const Edges8 middle = {_mm512_mul_pd(quarter, sum.x), _mm512_mul_pd(quarter, sum.y),
                         _mm512_mul_pd(quarter, sum.z)};
  const auto part = [&](__m512d g, __m512d e, __m512d m) __attribute__((always_inline)) {
    return _mm512_add_pd(_mm512_mul_pd(along, g), _mm512_mul_pd(inward, _mm512_sub_pd(e, m)));
  };
  const auto turn = [&](const Edges8 &e, Edges8 &g) __attribute__((always_inline)) {
    g = {part(g.x, e.x, middle.x), part(g.y, e.y, middle.y), part(g.z, e.z, middle.z)};
  };
  turn(e1, g1);
  turn(e2, g2);
  turn(e3, g3);
}

static void volume_cells8(const Block &b) {
  for (uint32_t t = 0; t < b.cells; t += 8) {
    const Cell *c = b.cell + t;
    if (b.ahead) fetch_cells(b, t);
    auto [e1, e2, e3, g1, g2, g3] = shape8(b, c);
    const __m512d volume6 = dot(e1, g1);
    const __m512d q = squares(e1, e2, e3);
    __m512d pressure = _mm512_set1_pd(1);
    if (any_far(b, t, q)) {
      stretched_forces(b, t, q, volume6, e1, e2, e3, g1, g2, g3);
    } else {
      pressure = pressure_of(b, t, volume6);
      if (!_mm512_cmp_pd_mask(pressure, _mm512_setzero_pd(), _CMP_NEQ_UQ)) continue;
    }
    Forces f1, f2, f3, sum;
    forces_at(pressure, g1, f1);
    forces_at(pressure, g2, f2);
    forces_at(pressure, g3, f3);
    sum = f1;
    add(sum, f2);
    add(sum, f3);
    spread_low(b, c, 1, f1);
    spread_low(b, c, 2, f2);
    spread_low(b, c, 3, f3);
    take_from(b, c[0].p[0], low(sum.f0));
    take_from(b, c[1].p[0], low(sum.f1));
    take_from(b, c[2].p[0], low(sum.f2));
    take_from(b, c[3].p[0], low(sum.f3));
    spread_high(b, c, 1, f1);
    spread_high(b, c, 2, f2);
    spread_high(b, c, 3, f3);
    take_from(b, c[4].p[0], high(sum.f0));
    take_from(b, c[5].p[0], high(sum.f1));
    take_from(b, c[6].p[0], high(sum.f2));
    take_from(b, c[7].p[0], high(sum.f3));
  }
}

// One spring's row sums, diagonal block and what is beside it, in a register.
DEFORM_INLINE __m512d row_of_spring(int k, __m512d along, __m512d all, __m256d d) {
  const __m512i turned = _mm512_setr_epi64(0, 1, 2, 3, 1, 2, 0, 3), lane = _mm512_set1_epi64(k);
  const __m512d twice = _mm512_broadcast_f64x4(d);
  const __m512d row = (_mm512_permutexvar_pd(lane, along) * twice) * _mm512_permutexvar_pd(turned, twice);
  return _mm512_mask_add_pd(row, 0x0f, row, _mm512_permutexvar_pd(lane, all));
}

// Of plain springs, as spring_rows of msm_kernel_quad.h.
static void spring_rows8(const Block &b) {
  for (uint32_t n = 0; n < b.local; ++n) _mm512_store_pd(b.row + 8 * size_t(n), _mm512_setzero_pd());
  const auto add = [&b](uint32_t n, __m512d row) __attribute__((always_inline)) {
    double *to = b.row + 8 * size_t(n);
    _mm512_store_pd(to, _mm512_load_pd(to) + row);
  };
  for (uint32_t n = 0; n < b.quads; n += 2) {
    const Quad *q = b.quad + n;
    __m256d d[2][4], dd2[2];
    for (int h = 0; h < 2; ++h) {
      const __m256d x = point4(b, q[h].i);
      for (int k = 0; k < 4; ++k) d[h][k] = point4(b, q[h].j[k]) - x;
      dd2[h] = lanes::sum_rows(d[h][0] * d[h][0], d[h][1] * d[h][1], d[h][2] * d[h][2], d[h][3] * d[h][3]);
    }
    const __m512d dd = _mm512_insertf64x4(_mm512_castpd256_pd512(dd2[0]), dd2[1], 1);
    const __m512d inverse = _mm512_set1_pd(1) / _mm512_sqrt_pd(dd);
    const __m512d more = _mm512_sqrt_pd(dd) - _mm512_load_pd(b.rest + 4 * size_t(n));
    const __m512d k = _mm512_load_pd(b.stiffness + 4 * size_t(n));
    const __mmask8 has_direction = _mm512_cmp_pd_mask(dd, _mm512_set1_pd(kShortestSquared), _CMP_GT_OQ);
    const __m512d straight =
        _mm512_maskz_sub_pd(has_direction, k, k * _mm512_max_pd(more * inverse, _mm512_setzero_pd()));
    const __m512d all = k - straight;
    const __m512d along = _mm512_maskz_mul_pd(has_direction, straight * inverse, inverse);
    for (int h = 0; h < 2; ++h) {
      __m512d row[4];
      for (int m = 0; m < 4; ++m) row[m] = row_of_spring(4 * h + m, along, all, d[h][m]);
      add(q[h].i, (row[0] + row[1]) + (row[2] + row[3]));
      for (int m = 0; m < 4; ++m) add(q[h].j[m], row[m]);
    }
  }
}

DEFORM_INLINE __m512d weights8(const Block &b, const Cell *c, int n) {
  const auto of = [&](int k) __attribute__((always_inline)) { return b.weight[c[k].p[n]]; };
  return _mm512_setr_pd(of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7));
}
DEFORM_INLINE __m512d norm8(const Edges8 &a) { return _mm512_sqrt_pd(dot(a, a)); }
DEFORM_INLINE Edges8 minus(const Edges8 &a, const Edges8 &b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

static void cell_rows8(const Block &b) {
  uint32_t limited = 0;
  for (uint32_t t = 0; t < b.cells; t += 8) {
    const Cell *c = b.cell + t;
    auto [e1, e2, e3, g1, g2, g3] = shape8(b, c);
    const Edges8 a = minus(e2, e1), d = minus(e3, e2), h = minus(e1, e3);
    const __m512d long1 = _mm512_max_pd(dot(e1, e1), dot(e2, e2)),
                  long2 = _mm512_max_pd(dot(e3, e3), dot(a, a));
    const __m512d long3 = _mm512_max_pd(dot(d, d), dot(h, h));
    const __m512d longest = _mm512_sqrt_pd(_mm512_max_pd(_mm512_max_pd(long1, long2), long3));
    const __m512d limit = _mm512_load_pd(b.limit + t), q = squares(e1, e2, e3);
    const __mmask8 far = _mm512_cmp_pd_mask(q, limit, _CMP_GT_OQ);
    __m512d now = dot(e1, g1);
    if (far) {
      __m512d by_q;
      now = now * fade(q, limit, by_q);
    }
    const __m512d pressure = _mm512_abs_pd(pressure_of(b, t, now)), more = pressure * longest;
    const __mmask8 counted =
        _mm512_cmp_pd_mask(_mm512_set1_pd(kCollapseCounted) * _mm512_load_pd(b.volume6 + t), now, _CMP_GT_OQ);
    const __m512d k = _mm512_load_pd(b.bulk + t) + _mm512_maskz_load_pd(counted, b.collapse + t);
    const __m512d w0 = weights8(b, c, 0), w1 = weights8(b, c, 1), w2 = weights8(b, c, 2),
                  w3 = weights8(b, c, 3);
    const __m512d w = (w0 + w1) + (w2 + w3);
    const __m512d n0 = norm8(sum3(g1, g2, g3)), n1 = norm8(g1), n2 = norm8(g2), n3 = norm8(g3);
    const __m512d sum = (n0 * w0 + n1 * w1) + (n2 * w2 + n3 * w3);
    alignas(64) double row[4][8];
    const auto store = [&](int corner, __m512d own, __m512d weight) __attribute__((always_inline)) {
      _mm512_store_pd(row[corner], k * (own * sum) + more * (w - weight));
    };
    store(0, n0, w0);
    store(1, n1, w1);
    store(2, n2, w2);
    store(3, n3, w3);
    if (far) {
      const __m512d beyond = k * (_mm512_set1_pd(kFade1) * (limit * limit)) +
                             pressure * (_mm512_set1_pd(kFade2) * _mm512_sqrt_pd(limit));
      const __m512d weight[4] = {w0, w1, w2, w3};
      for (int n = 0; n < 4; ++n) _mm512_mask_store_pd(row[n], far, beyond * weight[n]);
      limited += uint32_t(__builtin_popcount(far));
    }
    for (int n = 0; n < 8; ++n)
      for (int m = 0; m < 4; ++m) b.row[8 * size_t(c[n].p[m]) + 7] += row[m][n];
  }
  *b.limited = limited;
}

constexpr Kernels kKernels = {"avx512",
                              &single::kKernels,
                              load_block,
                              {MSM_SPRINGS(springs8)},
                              MSM_BRANCHES,
                              volume_cells8,
                              {spring_rows8, spring_rows<kTilted>, spring_rows<kTurned>},
                              cell_rows8,
                              merge_halo,
                              merge_rows,
                              add_to_host,
                              MSM_ENERGIES};

}  // namespace

const Kernels *kernels_avx512() { return &kKernels; }
}  // namespace msm
