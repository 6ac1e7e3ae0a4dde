// Energy of a spring of org.deform.msm: k/2 (L - L0)^2 in the length that counts (form B), of a branch
// k1/2 p^2 with p the stretch of its spring, and of form A the integral of its force, which is elementary:
//   E/k = int_l0^l (sqrt(s^2 + w^2) - L0) ds.
// With t = l + L, t0 = l0 + L0, t = t0 (1 + q), b = w^2/t0^2 all terms of first order cancel:
//   E/(k t0^2) = [ q^2/2 + b q^2/(1+q) - (b q)^2/(2 (1+q)^2) - 2 b (q - ln(1+q)) ]/4.
#pragma once
#include "mass_spring.h"

namespace msm {

// q - ln(grown), grown = 1 + q; near zero by the series of ln(1+q) = 2 artanh s, s = q/(2+q), so that small
// strains keep their digits.
inline double less_log(double q, double grown) {
  if (!(q > -0.25 && q < 0.25)) return q - dfm_log(grown);
  const double s = q / (2 + q), s2 = s * s;
  double series = 0;  // s^2/3 + s^4/5 + ..., |s| <= 1/7: ten terms leave 1e-18
  for (int n = 21; n >= 3; n -= 2) series = s2 * (1.0 / n + series);
  return 2 * s * (s / (1 - s) - series);
}

inline double turned_energy(double l, double l0, double tilt2) {
  if (!(tilt2 > 0)) return 0.5 * ((l - l0) * (l - l0));
  const double length = __builtin_sqrt(l * l + tilt2);
  const double length0 = __builtin_sqrt(l0 * l0 + tilt2);
  const double t0 = l0 + length0;
  const double b = tilt2 / (t0 * t0);
  // 1 + q by itself: where the ends meet it is w/t0, of which 1 + q would keep no digit
  const double more = l - l0;
  const double q = (more + more * ((l + l0) / (length + length0))) / t0;
  const double grown = (l + length) / t0;
  const double bq = b * q / grown;
  return t0 * t0 * 0.25 * (0.5 * (q * q) + q * bq - 0.5 * (bq * bq) - 2 * b * less_log(q, grown));
}

// state: r of each branch, then b of the last sub-step; NULL: branches, if any, count as new
inline double spring_energy(const Material &m, uint32_t e, const dfm_kin &k, const double *state) {
  const uint32_t *const ends = m.edges.data() + 2 * size_t(e);
  const double dd = square_between(k.x + size_t(k.stride) * ends[0], k.x + size_t(k.stride) * ends[1]);
  const double stiff = m.stiffness_of(e);
  if (m.is_turned())
    return stiff > 0 ? stiff * turned_energy(__builtin_sqrt(dd), m.edge_length[e], m.edge_tilt[e]) : 0;
  const double stretch = __builtin_sqrt(m.edge_tilt.empty() ? dd : dd + m.edge_tilt[e]) - m.rest_length(e);
  if (!m.has_branch() || !state) return 0.5 * stiff * (stretch * stretch);
  const double kept = state[e] + state[m.nedge] * stretch, part = m.part();
  return 0.5 * stiff * ((1 - part) * (stretch * stretch) + part * (kept * kept));
}

}  // namespace msm
