// The friction impulse by the linearized law of a contact. Internal linkage only.
#pragma once
#include "contact_kernel.h"

namespace dfm {
namespace {

struct Pair { double a, b; };

static inline double larger(double a, double b) { return a < b ? b : a; }  // as std::max, also of a NaN

// The normal impulse l of a contact: 0 <= l complementary to u_n + rate + min(c max(l - p, 0), m) >= 0, with
// compliance = (c, m, p). For the present l and k = u_n + rate, the new l is a root of
// k + wn (l' - l) + min(c max(l' - p, 0), m).
static inline double normal_impulse(double l, double k, double wn, const double *compliance) {
  const double firm = l - k / wn;
  if (compliance[0] == 0) return larger(0.0, firm);
  const double soft = l - (k + compliance[0] * (l - compliance[2])) / (wn + compliance[0]);
  return larger(0.0, larger(l - (k + compliance[1]) / wn, firm < soft ? firm : soft));
}
// m/s, by which the load presses the contact in.
static inline double given(double l, const double *compliance) {
  const double all = compliance[0] * larger(0.0, l - compliance[2]);
  return all < compliance[1] ? all : compliance[1];
}

// The friction impulse by the linearized law, for the present impulse (l1, l2), slip (u1, u2) and new normal
// impulse of the contact.
//
// Set-valued laws: lambda* = lambda - u / w_t would stop the slip. Inside the disc it is taken (stick);
// outside the contact slides along lambda* on a disc whose radius grows with the slip speed s by the law's
// slope c = -v^ . (dft/dv) v^ >= 0 (viscous part):
//     radius(s) = R + h c (s - s0),  s = w_t (|lambda*| - radius(s))
//     =>   s = w_t (|lambda*| - R + h c s0) / (1 + w_t h c).
// The radius follows the normal impulse: in proportion while it sticks, by the law's dft/dfn while it slips
// (its viscous part does not).
//
// Smooth laws: lambda = h [ft + D (u' - v) + d (fn' - fn)] with u' = u + w_t (lambda - lambda_old): a 2x2
// system that has a solution because D dissipates. D is not symmetric where the bristle and the slip are not
// parallel; without that part passes over the laws are no Newton steps and may go round
// (doc/decisions/friction_memory.md). The law's limit is kept: an elastic bristle that
// breaks away then slides on the cone at once instead of overshooting it. A contact that stuck when its law
// was evaluated is kept inside the limit in proportion to the normal impulse; one that slid, inside what
// the limit can be at all: limit(fn) is concave (a cone and a bounded part), so never above limit max(1, ln /
// (h fn)). Without that the sweeps can run away. Where fn is small dft_dfn is steep, by mu^2 sigma1/(4 sigma0
// h) with micro-damping, and holds for a hair's breadth alone; each sweep then answers a normal impulse with
// several times as much friction, that with a normal impulse beside it, and so on until nothing is finite.
//
// Inline in the loops of sweeps and residuals: each calls it once per contact and iteration.
__attribute__((always_inline)) static inline Pair friction_impulse(const LawView &s, uint32_t i, double h,
                                                                   double wt, double l1, double l2, double ln,
                                                                   double u1, double u2) {
  const size_t n = s.stride;
  const double fn = s.fn[i];
  if (s.form[i] == kSetValuedLaw) {
    const double ratio = fn > 0 ? ln / (h * fn) : 0;
    const double a = l1 - u1 / wt, b = l2 - u2 / wt, size = __builtin_sqrt(a * a + b * b);
    double radius = h * s.limit[i] * ratio;
    if (s.mode[i] == 2) {
      const double growth = __builtin_sqrt(s.dft_dfn[i] * s.dft_dfn[i] + s.dft_dfn[n + i] * s.dft_dfn[n + i]);
      radius = larger(0.0, h * s.limit[i] + growth * (ln - h * fn));
      const double v1 = s.vt[i], v2 = s.vt[n + i], speed = __builtin_sqrt(v1 * v1 + v2 * v2);
      double slope = 0;
      if (speed > 0) {
        const double e1 = v1 / speed, e2 = v2 / speed;
        slope = larger(0.0, -(e1 * (s.dft_dvt[i] * e1 + s.dft_dvt[n + i] * e2) +
                              e2 * (s.dft_dvt[2 * n + i] * e1 + s.dft_dvt[3 * n + i] * e2)));
      }
      if (slope > 0) {
        const double slip = larger(0.0, wt * (size - radius + h * slope * speed) / (1 + wt * h * slope));
        radius = larger(0.0, radius + h * slope * (slip - speed));
      }
    }
    if (size <= radius) return {a, b};
    return {radius / size * a, radius / size * b};
  }
  if (s.form[i] == kNoFriction) return {0, 0};
  const auto &[slope, m11, m12, m21, m22, det] = s.linear[i];
  const auto &[d11, d12, d21, d22] = slope;
  const double dfn = ln / h - fn;
  const double v1 = u1 - wt * l1 - s.vt[i], v2 = u2 - wt * l2 - s.vt[n + i];
  const double r1 = h * (s.ft[i] + d11 * v1 + d12 * v2 + s.dft_dfn[i] * dfn);
  const double r2 = h * (s.ft[n + i] + d21 * v1 + d22 * v2 + s.dft_dfn[n + i] * dfn);
  Pair l{(m22 * r1 - m12 * r2) / det, (m11 * r2 - m21 * r1) / det};
  const double size = __builtin_sqrt(l.a * l.a + l.b * l.b), radius = fn > 0 ? s.limit[i] / fn * ln : 0;
  const double most = s.mode[i] == 1 ? radius : larger(radius, h * s.limit[i]);
  if (size > most) l = {most / size * l.a, most / size * l.b};
  return l;
}

}  // namespace
}  // namespace dfm
