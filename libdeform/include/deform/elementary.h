/* deform/elementary.h -- exp, log, pow, sinpi and cospi from + - * / alone, for what runs inside a step: a C
 * library picks variants with fused multiply-add by processor, so its last bit differs between machines;
 * these give the same bits everywhere they are compiled without contraction (-ffp-contract=off, which
 * deform_add_plugin sets). Header only, C99 and C++17; no table, no branch on the common path, so loops over
 * them vectorise. Error, measured against 80-bit long double in the tests: dfm_exp and dfm_log below 1 ulp
 * (dfm_exp within half a subnormal where the result is subnormal), dfm_sinpi and dfm_cospi below 1.7 ulp,
 * dfm_pow below 2 ulp where |y log x| <= 40, growing to 40 ulp at the ends of the range. */
#ifndef DEFORM_ELEMENTARY_H
#define DEFORM_ELEMENTARY_H
#include <stdint.h>
#include <string.h>
#ifdef __cplusplus
extern "C" {
#endif

/* A function that is compiled for a wider instruction set than the rest of its file must not call code that
 * is not: such a file defines DFM_ELEMENTARY_ALWAYS_INLINE before it includes this header, and then passes
 * none of these functions on by its address. */
#if defined(DFM_ELEMENTARY_ALWAYS_INLINE) && defined(__GNUC__)
#define DFM_ELEMENTARY_ static inline __attribute__((always_inline))
#else
#define DFM_ELEMENTARY_ static inline
#endif

DFM_ELEMENTARY_ uint64_t dfm_bits_(double x) {
  uint64_t b;
  memcpy(&b, &x, sizeof b);
  return b;
}
DFM_ELEMENTARY_ double dfm_double_(uint64_t b) {
  double x;
  memcpy(&x, &b, sizeof x);
  return x;
}

/* 1.5 * 2^52: adding it rounds to the nearest integer, kept in the low bits */
#define DFM_ROUND_ 6755399441055744.0
#define DFM_LN2_HIGH_ 0x1.62e42fefa0000p-1 /* upper 33 bits of ln 2: exact times any exponent */
#define DFM_LN2_LOW_ 0x1.cf79abc9e3b3ap-40 /* the rest */

/* e^(high + low) with |low| far below an ulp of high. x = n ln 2 + r, |r| <= 0.347; e^r = 1 + (r + r^2 P(r)),
 * P the Taylor series up to r^13/13! (truncation below 4e-18); 2^n in two factors, so that results near both
 * ends of the range come out rounded once. */
DFM_ELEMENTARY_ double dfm_exp2_(double high, double low) {
  const double x = high < -750.0 ? -750.0 : high > 710.0 ? 710.0 : high; /* a NaN falls through */
  const double shifted = x * 0x1.71547652b82fep+0 + DFM_ROUND_, n = shifted - DFM_ROUND_;
  const uint64_t k = dfm_bits_(shifted) - dfm_bits_(DFM_ROUND_);
  /* halves, modulo 2^64: a NaN overflows nothing */
  const uint64_t k1 = ((k + 4096) >> 1) - 2048, k2 = k - k1;
  const double hi = x - n * DFM_LN2_HIGH_, lo = low - n * DFM_LN2_LOW_;
  const double r = hi + lo, tail = (hi - r) + lo, r2 = r * r, r4 = r2 * r2;
  const double p0 = 1.0 / 2 + r * (1.0 / 6);
  const double p1 = 1.0 / 24 + r * (1.0 / 120);
  const double p2 = 1.0 / 720 + r * (1.0 / 5040);
  const double p3 = 1.0 / 40320 + r * (1.0 / 362880), p4 = 1.0 / 3628800 + r * (1.0 / 39916800);
  const double p5 = 1.0 / 479001600 + r * (1.0 / 6227020800.0);
  const double p = (p0 + r2 * p1) + r4 * ((p2 + r2 * p3) + r4 * (p4 + r2 * p5));
  const double y = 1.0 + (r + (tail + r2 * p));
  return y * dfm_double_((1023 + k1) << 52) * dfm_double_((1023 + k2) << 52);
}

/** e^x; 0 below -745.2, +inf above 709.8, NaN for NaN. */
DFM_ELEMENTARY_ double dfm_exp(double x) { return dfm_exp2_(x, 0.0); }

/* ln x = high + low to about 2^-63 relative, x > 0 and finite. x = 2^k m, m in [sqrt 1/2, sqrt 2); s =
 * (m-1)/(m+1); ln m = 2 s + s q(s^2), q = 2 (s^2/3 + s^4/5 + ...), 12 terms (truncation below 1e-19). The
 * leading 2 s is carried in two doubles. */
DFM_ELEMENTARY_ void dfm_log2_(double x, double *high, double *low) {
  const int subnormal = x < 0x1p-1022;
  const uint64_t b = dfm_bits_(subnormal ? x * 0x1p54 : x);
  /* bits of sqrt 1/2: the exponent then counts from there */
  const uint64_t shifted = b - 0x3fe6a09e667f3bcdull;
  /* modulo 2^64; added to the bits of DFM_ROUND_ it reads as a double */
  const uint64_t k = ((shifted + ((uint64_t)2048 << 52)) >> 52) - 2048;
  const double n = (dfm_double_(dfm_bits_(DFM_ROUND_) + k) - DFM_ROUND_) - (subnormal ? 54.0 : 0.0);
  const double m = dfm_double_(0x3fe6a09e667f3bcdull + (shifted & 0x000fffffffffffffull));
  /* f exact; d + dlow = m + 1 exactly */
  const double f = m - 1.0, d = m + 1.0, dlow = (1.0 - d) + m;
  const double s = f / d;
  /* 26 bits each: products exact */
  const double sh = dfm_double_(dfm_bits_(s) & 0xfffffffff8000000ull), sl = s - sh;
  const double dh = dfm_double_(dfm_bits_(d) & 0xfffffffff8000000ull), dl = d - dh;
  /* what the division lost */
  const double slow = ((((f - sh * dh) - sh * dl) - sl * dh) - sl * dl - s * dlow) / d;
  const double z = s * s, z2 = z * z, z4 = z2 * z2;
  const double q = z * (((2.0 / 3 + z * (2.0 / 5)) + z2 * (2.0 / 7 + z * (2.0 / 9))) +
                        z4 * (((2.0 / 11 + z * (2.0 / 13)) + z2 * (2.0 / 15 + z * (2.0 / 17))) +
                              z4 * ((2.0 / 19 + z * (2.0 / 21)) + z2 * (2.0 / 23 + z * (2.0 / 25)))));
  /* |big| >= 0.69 or 0, |2 s| <= 0.35 */
  const double big = n * DFM_LN2_HIGH_, a = big + 2.0 * s;
  const double rest = ((big - a) + 2.0 * s) + (2.0 * slow + s * q + n * DFM_LN2_LOW_);
  *high = a + rest;
  *low = (a - *high) + rest;
}

/** Natural logarithm; -inf at 0, NaN below, +inf and NaN pass through. */
DFM_ELEMENTARY_ double dfm_log(double x) {
  double high, low;
  dfm_log2_(x, &high, &low);
  if (!(x > 0.0)) return x == 0.0 ? -1.0 / 0.0 : (x - x) / 0.0;
  return x > 1.7976931348623157e308 ? x : high;
}

/** x^y for x >= 0 (friction levels, not signed powers): x^0 = 1, 0^y = 0 for y > 0 and +inf below, NaN for x
 * < 0 and for a NaN. */
DFM_ELEMENTARY_ double dfm_pow(double x, double y) {
  double high, low;
  if (y == 0.0) return 1.0;
  if (!(x > 0.0) || x > 1.7976931348623157e308) {
    if (x == 0.0) return y > 0.0 ? 0.0 : y < 0.0 ? 1.0 / 0.0 : y;
    if (x > 0.0) return y > 0.0 ? x : y < 0.0 ? 0.0 : y;
    return (x - x) / 0.0;
  }
  dfm_log2_(x, &high, &low);
  {
    /* keeps the products below finite or signed infinite */
    const double yc = y > 1e300 ? 1e300 : y < -1e300 ? -1e300 : y;
    const double p = yc * high;
    const double yh = dfm_double_(dfm_bits_(yc) & 0xfffffffff8000000ull), yl = yc - yh;
    const double lh = dfm_double_(dfm_bits_(high) & 0xfffffffff8000000ull), ll = high - lh;
    const double plow = (((yh * lh - p) + yh * ll) + yl * lh) + yl * ll + yc * low;
    if (!(p < 711.0 && p > -751.0)) return p != p ? p : dfm_exp2_(p, 0.0);
    return dfm_exp2_(p, plow);
  }
}

/* sin(pi x) and cos(pi x), 0 <= x <= 1/2: both Taylor series at the distance y <= 1/4 from the nearer
 * end, up to (pi y)^19/19! and (pi y)^18/18! (truncation below 1e-19 of the value), then chosen. Exact
 * at 0 and 1/2. */
DFM_ELEMENTARY_ void dfm_sincospi_(double x, double *sine, double *cosine) {
  const double y = x < 0.25 ? x : 0.5 - x, z = y * y, z2 = z * z, z4 = z2 * z2;
  const double s1 = (-0x1.4abbce625be53p+2 + z * 0x1.466bc6775aae2p+1) +
                    z2 * (-0x1.32d2cce62bd86p-1 + z * 0x1.50783487ee782p-4);
  const double s2 = (-0x1.e3074fde8871fp-8 + z * 0x1.e8f434d018d63p-12) +
                    z2 * (-0x1.6fadb9f155744p-16 + z * 0x1.aaec32af93359p-21);
  const double c1 = (0x1.03c1f081b5ac4p+2 + z * -0x1.55d3c7e3cbffap+0) +
                    z2 * (0x1.e1f506891babbp-3 + z * -0x1.a6d1f2a204a8cp-6);
  const double c2 = (0x1.f9d38a3763cc3p-10 + z * -0x1.b6e24f44b128fp-14) +
                    z2 * (0x1.20c62c2f2d7f5p-18 + z * -0x1.2a0c591af8314p-23);
  /* pi in two doubles */
  const double s = y * 0x1.921fb54442d18p+1 + y * (z * (s1 + z4 * s2) + 0x1.1a62633145c07p-53);
  const double c = 1.0 + (z * -0x1.3bd3cc9be45dep+2 + z2 * (c1 + z4 * c2));
  *sine = x < 0.25 ? s : c;
  *cosine = x < 0.25 ? c : s;
}

/* x less the nearest even integer, in [-1, 1]; beyond 2^52 every double is an integer, beyond 2^53 an even
 * one. NaN and infinite: NaN. */
DFM_ELEMENTARY_ double dfm_turn_(double x) {
  const double size = x < 0.0 ? -x : x, whole = size >= 9007199254740992.0 ? 0.0 : size - 4503599627370496.0;
  const double y = size >= 4503599627370496.0 ? (x < 0.0 ? -whole : whole) : x, half = 0.5 * y;
  return (y - 2.0 * ((half + DFM_ROUND_) - DFM_ROUND_)) + 0.0 * x;
}

/** sin(pi x): 0 at every integer, for any x; NaN for NaN and infinite. */
DFM_ELEMENTARY_ double dfm_sinpi(double x) {
  const double t = dfm_turn_(x), size = t < 0.0 ? -t : t;
  double s, c;
  dfm_sincospi_(size > 0.5 ? 1.0 - size : size, &s, &c);
  return t < 0.0 ? -s : s;
}

/** cos(pi x); NaN for NaN and infinite. */
DFM_ELEMENTARY_ double dfm_cospi(double x) {
  const double t = dfm_turn_(x), size = t < 0.0 ? -t : t;
  double s, c;
  dfm_sincospi_(size > 0.5 ? 1.0 - size : size, &s, &c);
  return size > 0.5 ? -c : c;
}

#ifdef __cplusplus
}
#endif
#endif
