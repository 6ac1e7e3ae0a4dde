// The Stribeck curve of eight lanes:  g(w) = fn (mu_C + (mu_S - mu_C) s),  s = exp(-a),  a = (w/v_s)^delta;
// w g'(w) = fn (mu_S - mu_C) slope, slope = w s'(w) = -delta a s.
#pragma once
#include "lanes.h"

// A law with this curve begins with these parameters; check() is their rule.
#define CURVE_ROWS                                                                                    \
  dfm::plugin::param("mu_C", "kinetic friction coefficient", "1", 0, 100, 0.5, DFM_PARAM_RUNTIME),    \
      dfm::plugin::param("mu_S", "static friction coefficient", "1", 0, 100, 0.5, DFM_PARAM_RUNTIME), \
      dfm::plugin::param("v_s", "Stribeck speed", "m/s", 1e-9, 1e3, 0.01,                             \
                         DFM_PARAM_RUNTIME | DFM_PARAM_LOG_SCALE),                                    \
      dfm::plugin::param("delta", "Stribeck exponent", "1", 0.1, 10, 2, DFM_PARAM_RUNTIME)

namespace lanes {

inline dfm_status check(const double *p, char *why, size_t cap) {
  if (p[1] >= p[0]) return DFM_OK;
  std::snprintf(why, cap, "mu_S (%g) must not be below mu_C (%g); give both, or \"mu\" for mu_C = mu_S", p[1],
                p[0]);
  return DFM_E_ARG;
}

// dfm_pow for a base in (0, 1e300) and an exponent in [0.1, 10]: the same operations without its branches, so
// the same bits in every lane.
DEFORM_PASS inline double power(double x, double y) {
  double high, low;
  dfm_log2_(x, &high, &low);
  const double p = y * high;
  const double yh = dfm_double_(dfm_bits_(y) & 0xfffffffff8000000ull), yl = y - yh;
  const double lh = dfm_double_(dfm_bits_(high) & 0xfffffffff8000000ull), ll = high - lh;
  const double plow = (((yh * lh - p) + yh * ll) + yl * lh) + yl * ll + y * low;
  return dfm_exp2_(p, p < 711.0 && p > -751.0 ? plow : 0.0);
}

// excess = s, slope = w s'(w) at the speeds w, 0 <= w < 1e200.
DEFORM_PASS inline void curve(double v_s, double delta, const double *w, double *excess, double *slope) {
  double a[kLanes], e[kLanes];
  const double inverse = 1.0 / v_s;
  if (delta == 2.0) {
    EACH_LANE (i) {
      const double x = w[i] * inverse;
      a[i] = x * x;
    }
  } else {
    double x[kLanes];
    EACH_LANE (i) x[i] = w[i] * inverse;
    EACH_LANE (i) a[i] = power(x[i] > 1e-300 ? x[i] : 1e-300, delta);
    EACH_LANE (i) a[i] = x[i] > 0 ? a[i] : 0.0;
  }
  EACH_LANE (i) e[i] = dfm_exp(-a[i]);
  EACH_LANE (i) {
    excess[i] = e[i];
    slope[i] = e[i] > 0 ? -delta * a[i] * e[i] : 0.0;  // a may be infinite where e is zero
  }
}

}  // namespace lanes
