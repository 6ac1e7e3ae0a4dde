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

// Eight cells at a time.
struct Eight {
  typedef __m512d V;
  static constexpr uint32_t kLanes = 8;
  DEFORM_INLINE V splat(double a) { return _mm512_set1_pd(a); }
  DEFORM_INLINE V load(const double *p) { return _mm512_load_pd(p); }
  DEFORM_INLINE void store(double *p, V a) { _mm512_store_pd(p, a); }
  DEFORM_INLINE V root(V a) { return _mm512_sqrt_pd(a); }
  DEFORM_INLINE V more(V a, V b) { return _mm512_max_pd(a, b); }
  DEFORM_INLINE V less(V a, V b) { return _mm512_min_pd(a, b); }
  DEFORM_INLINE V abs(V a) { return _mm512_abs_pd(a); }
  DEFORM_INLINE __mmask8 above(V a, V limit) { return _mm512_cmp_pd_mask(a, limit, _CMP_GT_OQ); }
  DEFORM_INLINE bool any_above(V a, V limit) { return above(a, limit); }
  DEFORM_INLINE uint32_t count_above(V a, V limit) { return uint32_t(__builtin_popcount(above(a, limit))); }
  DEFORM_INLINE V choose_above(V a, V limit, V yes, V no) {
    return _mm512_mask_blend_pd(above(a, limit), no, yes);
  }
  DEFORM_INLINE bool all_zero(V a) { return !_mm512_cmp_pd_mask(a, _mm512_setzero_pd(), _CMP_NEQ_UQ); }
  DEFORM_INLINE V weights(const Block &b, const Cell *c, int n) {
    const auto of = [&](int k) __attribute__((always_inline)) { return b.weight[c[k].p[n]]; };
    return _mm512_setr_pd(of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7));
  }
  DEFORM_INLINE void gather(const Block &b, const Cell *c, Three<Eight> &e1, Three<Eight> &e2,
                            Three<Eight> &e3) {
    const V o0 = corner(b, c, 0, 0), o1 = corner(b, c, 1, 0), o2 = corner(b, c, 2, 0),
            o3 = corner(b, c, 3, 0);
    const auto edges = [&](int n, Three<Eight> &e) __attribute__((always_inline)) {
      V unused = corner(b, c, 3, n) - o3;
      e = {corner(b, c, 0, n) - o0, corner(b, c, 1, n) - o1, corner(b, c, 2, n) - o2};
      transpose(e.x, e.y, e.z, unused);
    };
    edges(1, e1);
    edges(2, e2);
    edges(3, e3);
  }
  // One cell after the other at each corner, corners 1 2 3 0, four cells at a time: the order of the other
  // kernels.
  DEFORM_INLINE void spread(const Block &b, const Cell *c, V pressure, const Cells<Eight> &cells) {
    V f[3][4];  // of corners, cells k and k + 4
    const auto forces = [&](V *at, const Three<Eight> &g) __attribute__((always_inline)) {
      at[0] = pressure * g.x;
      at[1] = pressure * g.y;
      at[2] = pressure * g.z;
      at[3] = _mm512_setzero_pd();
      transpose(at[0], at[1], at[2], at[3]);
    };
    forces(f[0], cells.g1);
    forces(f[1], cells.g2);
    forces(f[2], cells.g3);
    for (int n = 0; n < 3; ++n)
      for (int k = 0; k < 4; ++k) add_to(b, c[k].p[n + 1], low(f[n][k]));
    for (int k = 0; k < 4; ++k) take_from(b, c[k].p[0], low((f[0][k] + f[1][k]) + f[2][k]));
    for (int n = 0; n < 3; ++n)
      for (int k = 0; k < 4; ++k) add_to(b, c[k + 4].p[n + 1], high(f[n][k]));
    for (int k = 0; k < 4; ++k) take_from(b, c[k + 4].p[0], high((f[0][k] + f[1][k]) + f[2][k]));
  }
};

// One spring's row sums, diagonal block and what is beside it, in a register.
DEFORM_INLINE __m512d row_of_spring(int k, __m512d along, __m512d all, __m256d d) {
  const __m512i turned = _mm512_setr_epi64(0, 1, 2, 3, 1, 2, 0, 3), lane = _mm512_set1_epi64(k);
  const __m512d twice = _mm512_broadcast_f64x4(d);
  const __m512d row = (_mm512_permutexvar_pd(lane, along) * twice) * _mm512_permutexvar_pd(turned, twice);
  return _mm512_mask_add_pd(row, 0x0f, row, _mm512_permutexvar_pd(lane, all));
}

// Rows of plain springs, as spring_rows of msm_kernel_quad.h.
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

constexpr Kernels kKernels = {"avx512",
                              &single::kKernels,
                              load_block,
                              {MSM_SPRINGS(springs8)},
                              MSM_BRANCHES,
                              volume_cells<Eight>,
                              {spring_rows8, spring_rows<kTilted>, spring_rows<kTurned>},
                              cell_rows<Eight>,
                              merge_halo,
                              merge_rows,
                              add_to_host,
                              MSM_ENERGIES};

}  // namespace

const Kernels *kernels_avx512() { return &kKernels; }
}  // namespace msm
