// Four doubles as two SSE2 registers, the baseline of x86-64; SIMDe makes them of what other processors have.
// Internal linkage only.
#pragma once
#if defined(__x86_64__)
#include <emmintrin.h>
#else
#define SIMDE_ENABLE_NATIVE_ALIASES
#include <simde/x86/sse2.h>
#endif
#include <stdint.h>

#define DEFORM_INLINE static inline __attribute__((always_inline))

namespace lanes {
namespace {

struct v4 { __m128d lo, hi; };

DEFORM_INLINE v4 operator+(v4 a, v4 b) { return {_mm_add_pd(a.lo, b.lo), _mm_add_pd(a.hi, b.hi)}; }
DEFORM_INLINE v4 operator-(v4 a, v4 b) { return {_mm_sub_pd(a.lo, b.lo), _mm_sub_pd(a.hi, b.hi)}; }
DEFORM_INLINE v4 operator*(v4 a, v4 b) { return {_mm_mul_pd(a.lo, b.lo), _mm_mul_pd(a.hi, b.hi)}; }
DEFORM_INLINE v4 operator/(v4 a, v4 b) { return {_mm_div_pd(a.lo, b.lo), _mm_div_pd(a.hi, b.hi)}; }
DEFORM_INLINE v4 load4(const double *p) { return {_mm_load_pd(p), _mm_load_pd(p + 2)}; }
DEFORM_INLINE void store4(double *p, v4 a) {
  _mm_store_pd(p, a.lo);
  _mm_store_pd(p + 2, a.hi);
}
DEFORM_INLINE v4 load4_anywhere(const double *p) { return {_mm_loadu_pd(p), _mm_loadu_pd(p + 2)}; }
DEFORM_INLINE void store4_anywhere(double *p, v4 a) {
  _mm_storeu_pd(p, a.lo);
  _mm_storeu_pd(p + 2, a.hi);
}
DEFORM_INLINE v4 load4_single(const float *p) {
  const __m128 a = _mm_load_ps(p);
  return {_mm_cvtps_pd(a), _mm_cvtps_pd(_mm_movehl_ps(a, a))};
}
DEFORM_INLINE void store4_single(float *p, v4 a) {
  _mm_store_ps(p, _mm_movelh_ps(_mm_cvtpd_ps(a.lo), _mm_cvtpd_ps(a.hi)));
}
// to the nearest, of two the even one
DEFORM_INLINE void store4_whole(int32_t *p, v4 a) {
  _mm_store_si128(reinterpret_cast<__m128i *>(p),
                  _mm_unpacklo_epi64(_mm_cvtpd_epi32(a.lo), _mm_cvtpd_epi32(a.hi)));
}
DEFORM_INLINE v4 load_xyz(const double *p) { return {_mm_loadu_pd(p), _mm_load_sd(p + 2)}; }
DEFORM_INLINE v4 splat(double a) { return {_mm_set1_pd(a), _mm_set1_pd(a)}; }
DEFORM_INLINE v4 set4(double a, double b, double c, double d) {
  return {_mm_setr_pd(a, b), _mm_setr_pd(c, d)};
}
DEFORM_INLINE v4 sqrt4(v4 a) { return {_mm_sqrt_pd(a.lo), _mm_sqrt_pd(a.hi)}; }
DEFORM_INLINE v4 max4(v4 a, v4 b) { return {_mm_max_pd(a.lo, b.lo), _mm_max_pd(a.hi, b.hi)}; }
DEFORM_INLINE v4 min4(v4 a, v4 b) { return {_mm_min_pd(a.lo, b.lo), _mm_min_pd(a.hi, b.hi)}; }
DEFORM_INLINE bool any_above(v4 a, v4 limit) {
  return _mm_movemask_pd(_mm_cmpgt_pd(a.lo, limit.lo)) | _mm_movemask_pd(_mm_cmpgt_pd(a.hi, limit.hi));
}
// bit k: lane k lies above; never for a NaN
DEFORM_INLINE uint32_t mask_above(v4 a, v4 limit) {
  return uint32_t(_mm_movemask_pd(_mm_cmpgt_pd(a.lo, limit.lo)) |
                  _mm_movemask_pd(_mm_cmpgt_pd(a.hi, limit.hi)) << 2);
}
DEFORM_INLINE uint32_t count_above(v4 a, v4 limit) {
  return uint32_t(__builtin_popcount(mask_above(a, limit)));
}
DEFORM_INLINE __m128d choose(__m128d mask, __m128d yes, __m128d no) {
  return _mm_or_pd(_mm_and_pd(mask, yes), _mm_andnot_pd(mask, no));
}
DEFORM_INLINE v4 choose_above(v4 a, v4 limit, v4 above, v4 below) {
  return {choose(_mm_cmpgt_pd(a.lo, limit.lo), above.lo, below.lo),
          choose(_mm_cmpgt_pd(a.hi, limit.hi), above.hi, below.hi)};
}
DEFORM_INLINE v4 abs4(v4 a) {
  return {_mm_andnot_pd(_mm_set1_pd(-0.0), a.lo), _mm_andnot_pd(_mm_set1_pd(-0.0), a.hi)};
}
DEFORM_INLINE v4 zero_unless_above(v4 value, v4 a, v4 limit) {
  return {_mm_and_pd(value.lo, _mm_cmpgt_pd(a.lo, limit.lo)),
          _mm_and_pd(value.hi, _mm_cmpgt_pd(a.hi, limit.hi))};
}
DEFORM_INLINE bool all_zero(v4 a) {
  const __m128d zero = _mm_setzero_pd();
  return !(_mm_movemask_pd(_mm_cmpneq_pd(a.lo, zero)) | _mm_movemask_pd(_mm_cmpneq_pd(a.hi, zero)));
}
DEFORM_INLINE v4 yzx(v4 a) { return {_mm_shuffle_pd(a.lo, a.hi, 1), _mm_shuffle_pd(a.lo, a.hi, 2)}; }
template <int kLane>
DEFORM_INLINE v4 lane(v4 a) {
  const __m128d half = kLane < 2 ? a.lo : a.hi;
  const __m128d all = kLane % 2 ? _mm_unpackhi_pd(half, half) : _mm_unpacklo_pd(half, half);
  return {all, all};
}
DEFORM_INLINE __m128d sum_pairs(__m128d a, __m128d b) {
  return _mm_add_pd(_mm_unpacklo_pd(a, b), _mm_unpackhi_pd(a, b));
}
// k-th lane of the result: (s_k.x + s_k.y) + (s_k.z + s_k.w)
DEFORM_INLINE v4 sum_rows(v4 s0, v4 s1, v4 s2, v4 s3) {
  return {_mm_add_pd(sum_pairs(s0.lo, s1.lo), sum_pairs(s0.hi, s1.hi)),
          _mm_add_pd(sum_pairs(s2.lo, s3.lo), sum_pairs(s2.hi, s3.hi))};
}
DEFORM_INLINE void transpose(v4 &r0, v4 &r1, v4 &r2, v4 &r3) {
  const v4 a = {_mm_unpacklo_pd(r0.lo, r1.lo), _mm_unpacklo_pd(r2.lo, r3.lo)};
  const v4 b = {_mm_unpackhi_pd(r0.lo, r1.lo), _mm_unpackhi_pd(r2.lo, r3.lo)};
  const v4 c = {_mm_unpacklo_pd(r0.hi, r1.hi), _mm_unpacklo_pd(r2.hi, r3.hi)};
  const v4 d = {_mm_unpackhi_pd(r0.hi, r1.hi), _mm_unpackhi_pd(r2.hi, r3.hi)};
  r0 = a;
  r1 = b;
  r2 = c;
  r3 = d;
}

}  // namespace
}  // namespace lanes
