// What a law, linearized where it was last asked, answers at one contact together with the contact's own
// response: the friction impulse and its slope.
#pragma once
#include <algorithm>
#include <cmath>

#include "contact/contact_state.h"

namespace dfm {

struct Tangential { double a, b; };  // in the contact's tangent plane

// -d(friction impulse)/d(slip), kg: [a b; b c], symmetric and positive semidefinite. Where the limit cuts a
// smooth law it is the symmetric part on the tangent of the disc.
struct FrictionSlope { double a = 0, b = 0, c = 0; };

// Friction impulse that the linearized law wants of contact i, given the contact's present impulse l and slip
// u, its new normal impulse ln, and its response wt (1/kg).
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
// system, positive definite
// because only the negative semidefinite part of D is used. The law's limit is kept: an elastic bristle that
// breaks away then slides on the cone at once instead of overshooting it. A contact that stuck when its law
// was asked is kept inside the limit in proportion to the normal impulse. One that slid is kept inside what
// the limit can be at all: limit(fn) is concave (a cone and a bounded part), so never above limit max(1, ln /
// (h fn)). Without that the sweeps can run away. Where fn is small dft_dfn is steep, by mu^2 sigma1/(4 sigma0
// h) with micro-damping, and holds for a hair's breadth alone; each sweep then answers a normal impulse with
// several times as much friction, that with a normal impulse beside it, and so on until nothing is finite.
inline Tangential friction_impulse(const ContactState &s, uint32_t i, double h, double wt, Tangential present,
                                   Tangential slip, double ln, FrictionSlope *slope = nullptr) {
  const auto [l1, l2] = present;
  const auto [u1, u2] = slip;
  const uint32_t n = s.stride;
  const double fn = s.fn[i];
  if (s.set_valued[i]) {
    const double ratio = fn > 0 ? ln / (h * fn) : 0;
    const double a = l1 - u1 / wt, b = l2 - u2 / wt, size = std::sqrt(a * a + b * b);
    double radius = h * s.limit[i] * ratio;
    double along = 0;  // how much the radius grows with `size`
    if (s.mode[i] == 2) {
      const double growth = std::sqrt(s.dft_dfn[i] * s.dft_dfn[i] + s.dft_dfn[n + i] * s.dft_dfn[n + i]);
      radius = std::max(0.0, h * s.limit[i] + growth * (ln - h * fn));
      const double v1 = s.vt[i], v2 = s.vt[n + i], speed = std::sqrt(v1 * v1 + v2 * v2);
      double viscous = 0;
      if (speed > 0) {
        const double e1 = v1 / speed, e2 = v2 / speed;
        viscous = std::max(0.0, -(e1 * (s.dft_dvt[i] * e1 + s.dft_dvt[n + i] * e2) +
                                  e2 * (s.dft_dvt[2 * n + i] * e1 + s.dft_dvt[3 * n + i] * e2)));
      }
      const double ends = std::max(0.0, wt * (size - radius + h * viscous * speed) / (1 + wt * h * viscous));
      if (ends > 0) along = wt * h * viscous / (1 + wt * h * viscous);
      radius = std::max(0.0, radius + h * viscous * (ends - speed));
      if (radius == 0) along = 0;
    }
    if (size <= radius) {
      if (slope) *slope = {1 / wt, 0, 1 / wt};
      return {a, b};
    }
    if (slope) {
      const double e1 = a / size, e2 = b / size, across = radius / size, more = along - across;
      *slope = {(across + more * e1 * e1) / wt, more * e1 * e2 / wt, (across + more * e2 * e2) / wt};
    }
    return {radius / size * a, radius / size * b};
  }
  const auto [d11, d12, d22] = dissipative_slope(s, i);
  const double dfn = ln / h - fn;
  const double v1 = u1 - wt * l1 - s.vt[i], v2 = u2 - wt * l2 - s.vt[n + i];
  const double r1 = h * (s.ft[i] + d11 * v1 + d12 * v2 + s.dft_dfn[i] * dfn);
  const double r2 = h * (s.ft[n + i] + d12 * v1 + d22 * v2 + s.dft_dfn[n + i] * dfn);
  const double m11 = 1 - h * wt * d11;
  const double m22 = 1 - h * wt * d22;
  const double m12 = -h * wt * d12;
  const double det = m11 * m22 - m12 * m12;
  Tangential l{(m22 * r1 - m12 * r2) / det, (m11 * r2 - m12 * r1) / det};
  const double size = std::sqrt(l.a * l.a + l.b * l.b), radius = fn > 0 ? s.limit[i] / fn * ln : 0;
  const double most = s.mode[i] == 1 ? radius : std::max(radius, h * s.limit[i]);
  if (slope) {
    // -h (1 - h wt D)^-1 D: both factors are polynomials of D, so the product is symmetric
    *slope = {-h * (m22 * d11 - m12 * d12) / det, -h * (m22 * d12 - m12 * d22) / det,
              -h * (m11 * d22 - m12 * d12) / det};
    if (size > most) {
      const double e1 = -l.b / size, e2 = l.a / size;
      const double turn =
          most / size * (e1 * (slope->a * e1 + slope->b * e2) + e2 * (slope->b * e1 + slope->c * e2));
      *slope = {turn * e1 * e1, turn * e1 * e2, turn * e2 * e2};
    }
  }
  if (size > most) l = {most / size * l.a, most / size * l.b};
  return l;
}

}  // namespace dfm
