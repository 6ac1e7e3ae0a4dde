// Four doubles in one AVX register, for the files compiled with it. Internal linkage only.
#pragma once
// GCC 12 warns about the undefined pass-through operand of its own unmasked intrinsics
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wuninitialized"
#endif
#include <immintrin.h>
#include <stdint.h>

#define DEFORM_INLINE static inline __attribute__((always_inline))

namespace lanes {
namespace {

typedef __m256d v4;

DEFORM_INLINE v4 load4(const double *p) { return _mm256_load_pd(p); }
DEFORM_INLINE void store4(double *p, v4 a) { _mm256_store_pd(p, a); }
DEFORM_INLINE v4 load4_anywhere(const double *p) { return _mm256_loadu_pd(p); }
DEFORM_INLINE void store4_anywhere(double *p, v4 a) { _mm256_storeu_pd(p, a); }
DEFORM_INLINE v4 load4_single(const float *p) { return _mm256_cvtps_pd(_mm_load_ps(p)); }
DEFORM_INLINE void store4_single(float *p, v4 a) { _mm_store_ps(p, _mm256_cvtpd_ps(a)); }
// to the nearest, of two the even one
DEFORM_INLINE void store4_whole(int32_t *p, v4 a) {
  _mm_store_si128(reinterpret_cast<__m128i *>(p), _mm256_cvtpd_epi32(a));
}
// masked: never read
DEFORM_INLINE v4 load_xyz(const double *p) {
  return _mm256_maskload_pd(p, _mm256_setr_epi64x(-1, -1, -1, 0));
}
DEFORM_INLINE v4 splat(double a) { return _mm256_set1_pd(a); }
DEFORM_INLINE v4 set4(double a, double b, double c, double d) { return _mm256_setr_pd(a, b, c, d); }
DEFORM_INLINE v4 sqrt4(v4 a) { return _mm256_sqrt_pd(a); }
DEFORM_INLINE v4 max4(v4 a, v4 b) { return _mm256_max_pd(a, b); }
DEFORM_INLINE v4 min4(v4 a, v4 b) { return _mm256_min_pd(a, b); }
DEFORM_INLINE bool any_above(v4 a, v4 limit) {
  return _mm256_movemask_pd(_mm256_cmp_pd(a, limit, _CMP_GT_OQ));
}
// bit k: lane k lies above; never for a NaN
DEFORM_INLINE uint32_t mask_above(v4 a, v4 limit) {
  return uint32_t(_mm256_movemask_pd(_mm256_cmp_pd(a, limit, _CMP_GT_OQ)));
}
DEFORM_INLINE uint32_t count_above(v4 a, v4 limit) {
  return uint32_t(__builtin_popcount(mask_above(a, limit)));
}
DEFORM_INLINE v4 choose_above(v4 a, v4 limit, v4 above, v4 below) {
  return _mm256_blendv_pd(below, above, _mm256_cmp_pd(a, limit, _CMP_GT_OQ));
}
DEFORM_INLINE v4 abs4(v4 a) { return _mm256_andnot_pd(_mm256_set1_pd(-0.0), a); }
DEFORM_INLINE v4 zero_unless_above(v4 value, v4 a, v4 limit) {
  return _mm256_and_pd(value, _mm256_cmp_pd(a, limit, _CMP_GT_OQ));
}
DEFORM_INLINE bool all_zero(v4 a) {
  return !_mm256_movemask_pd(_mm256_cmp_pd(a, _mm256_setzero_pd(), _CMP_NEQ_UQ));
}
DEFORM_INLINE v4 yzx(v4 a) { return _mm256_permute4x64_pd(a, 0xc9); }
template <int kLane>
DEFORM_INLINE v4 lane(v4 a) {
  return _mm256_permute4x64_pd(a, kLane * 0x55);
}

// k-th lane of the result: (s_k.x + s_k.y) + (s_k.z + s_k.w)
DEFORM_INLINE v4 sum_rows(v4 s0, v4 s1, v4 s2, v4 s3) {
  const v4 a = _mm256_add_pd(_mm256_unpacklo_pd(s0, s1), _mm256_unpackhi_pd(s0, s1));
  const v4 b = _mm256_add_pd(_mm256_unpacklo_pd(s2, s3), _mm256_unpackhi_pd(s2, s3));
  return _mm256_add_pd(_mm256_permute2f128_pd(a, b, 0x20), _mm256_permute2f128_pd(a, b, 0x31));
}
DEFORM_INLINE void transpose(v4 &r0, v4 &r1, v4 &r2, v4 &r3) {
  const v4 a = _mm256_unpacklo_pd(r0, r1);
  const v4 b = _mm256_unpackhi_pd(r0, r1);
  const v4 c = _mm256_unpacklo_pd(r2, r3);
  const v4 d = _mm256_unpackhi_pd(r2, r3);
  r0 = _mm256_permute2f128_pd(a, c, 0x20);
  r1 = _mm256_permute2f128_pd(b, d, 0x20);
  r2 = _mm256_permute2f128_pd(a, c, 0x31);
  r3 = _mm256_permute2f128_pd(b, d, 0x31);
}

}  // namespace
}  // namespace lanes
