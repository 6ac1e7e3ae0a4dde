// The impulse of one contact by its linearized law, and the residual of its row.
#pragma once
#include <algorithm>
#include <cmath>

#include "contact/contact_state.h"
#include "contact/rows.h"
#include "contact/solve_settings.h"
#include "contact/solver.h"

namespace dfm {

struct Pair { double a, b; };

// The normal impulse l of a contact: 0 <= l complementary to u_n + rate + min(c max(l - p, 0), m) >= 0, with
// compliance = (c, m, p). For the present l and k = u_n + rate, the new l is a root of
// k + wn (l' - l) + min(c max(l' - p, 0), m).
inline double normal_impulse(double l, double k, double wn, const double *compliance) {
  const double firm = l - k / wn;
  if (compliance[0] == 0) return std::max(0.0, firm);
  const double soft = l - (k + compliance[0] * (l - compliance[2])) / (wn + compliance[0]);
  return std::max(0.0, std::max(l - (k + compliance[1]) / wn, firm < soft ? firm : soft));
}
// m/s, by which the load presses the contact in.
inline double yield_speed(double l, const double *compliance) {
  const double all = compliance[0] * std::max(0.0, l - compliance[2]);
  return all < compliance[1] ? all : compliance[1];
}

// The point of the disc of this radius that is nearest to (a, b).
inline Pair on_disc(double a, double b, double radius) {
  const double size = std::sqrt(a * a + b * b);
  if (size <= radius) return {a, b};
  return {radius / size * a, radius / size * b};
}

// How the limit of a set-valued law that slips along the unit vector e grows with the normal force, and, N
// s/m, with the speed.
inline double limit_growth(const ContactState &s, uint32_t i) {
  const size_t n = s.stride;
  return std::sqrt(s.dft_dfn[i] * s.dft_dfn[i] + s.dft_dfn[n + i] * s.dft_dfn[n + i]);
}
inline double viscous_slope(const ContactState &s, uint32_t i, double e1, double e2) {
  const size_t n = s.stride;
  return std::max(0.0, -(e1 * (s.dft_dvt[i] * e1 + s.dft_dvt[n + i] * e2) +
                         e2 * (s.dft_dvt[2 * n + i] * e1 + s.dft_dvt[3 * n + i] * e2)));
}

// The disc of a set-valued law's friction impulse at the normal impulse ln, for an impulse of this size that
// would stop the slip. radius: N s; grows: its derivative by ln; along: kg, its derivative by the slip that
// others leave, over a response wt.
struct Disc { double radius, grows, along; };
inline Disc disc_of(const ContactState &s, uint32_t i, double h, double wt, double size, double ln) {
  const size_t n = s.stride;
  const double fn = s.fn[i];
  if (s.mode[i] != 2) {
    const double ratio = fn > 0 ? ln / (h * fn) : 0;
    return {h * s.limit[i] * ratio, fn > 0 ? s.limit[i] / fn : 0, 0};
  }
  const double growth = limit_growth(s, i);
  Disc disc{std::max(0.0, h * s.limit[i] + growth * (ln - h * fn)), growth, 0};
  const double v1 = s.vt[i], v2 = s.vt[n + i], speed = std::sqrt(v1 * v1 + v2 * v2);
  const double slope = speed > 0 ? viscous_slope(s, i, v1 / speed, v2 / speed) : 0;
  if (slope > 0) {
    const double slip = std::max(0.0, wt * (size - disc.radius + h * slope * speed) / (1 + wt * h * slope));
    disc.radius = std::max(0.0, disc.radius + h * slope * (slip - speed));
    disc.along = h * slope / (1 + wt * h * slope);
    disc.grows /= 1 + wt * h * slope;
  }
  return disc;
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
__attribute__((always_inline)) inline Pair friction_impulse(const ContactState &s, uint32_t i, double h,
                                                            double wt, double l1, double l2, double ln,
                                                            double u1, double u2) {
  const size_t n = s.stride;
  const double fn = s.fn[i];
  if (s.form[i] == kSetValuedLaw) {
    const double a = l1 - u1 / wt, b = l2 - u2 / wt, size = std::sqrt(a * a + b * b);
    return on_disc(a, b, disc_of(s, i, h, wt, size, ln).radius);
  }
  if (s.form[i] == kNoFriction) return {0, 0};
  const auto &[slope, m11, m12, m21, m22, det] = s.linear[i];
  const auto &[d11, d12, d21, d22] = slope;
  const double dfn = ln / h - fn;
  const double v1 = u1 - wt * l1 - s.vt[i], v2 = u2 - wt * l2 - s.vt[n + i];
  const double r1 = h * (s.ft[i] + d11 * v1 + d12 * v2 + s.dft_dfn[i] * dfn);
  const double r2 = h * (s.ft[n + i] + d21 * v1 + d22 * v2 + s.dft_dfn[n + i] * dfn);
  const double radius = fn > 0 ? s.limit[i] / fn * ln : 0;
  return on_disc((m22 * r1 - m12 * r2) / det, (m11 * r2 - m21 * r1) / det,
                 s.mode[i] == 1 ? radius : std::max(radius, h * s.limit[i]));
}

// The step of a sweep at row i, whose sides move by u: by, out, is the change of its impulse l. False: there
// is none.
inline bool solve_row(const ContactRows &rows, const ContactState &law, uint32_t i, double h, Vec3 u,
                      double *l, Vec3 &by) {
  const double wn = rows.wn[i], wt = rows.wt[i];
  const double ln = normal_impulse(l[0], u.x + rows.rate[i], wn, &rows.compliance[3 * size_t(i)]),
               d = ln - l[0];
  if (ln == 0 && l[0] == 0 && l[1] == 0 && l[2] == 0) return false;
  Pair t{0, 0};
  if (ln > 0 && wt > 0) {
    const double *const c = &rows.cross[2 * size_t(i)];
    t = friction_impulse(law, i, h, wt, l[1], l[2], ln, u.y + c[0] * d, u.z + c[1] * d);
  }
  if (d == 0 && t.a == l[1] && t.b == l[2]) return false;
  by = {d, t.a - l[1], t.b - l[2]};
  l[0] = ln;
  l[1] = t.a;
  l[2] = t.b;
  return true;
}

// m/s, of row i; u: of its sides along the normal.
inline double normal_residual(const ContactRows &rows, uint32_t i, double u, const double *l) {
  const double open = u + rows.rate[i] + yield_speed(l[0], &rows.compliance[3 * size_t(i)]),
               closed = rows.wn[i] * l[0];
  return std::fabs(open < closed ? open : closed);
}

// The force of row i by its law, compared by the answer that both give together with the contact's own
// response, not by the bare force: the difference is the velocity that is left to correct. Where a set-valued
// law just slips, force and slip may differ in direction by much while that is tiny; a smooth law with a
// steep slope c would count it 1 + h w_t c times.
inline double tangent_residual(const ContactRows &rows, const ContactState &law, uint32_t i, double h, Vec3 u,
                               const double *l) {
  const Pair t = friction_impulse(law, i, h, rows.wt[i], l[1], l[2], l[0], u.y, u.z);
  const double a = t.a - l[1], b = t.b - l[2];
  return rows.wt[i] * std::sqrt(a * a + b * b);
}

// Adds row i to the residual of a state. nan_flag: NaN if a value is not finite; std::max() passes over it.
inline void add_residual(const ContactRows &rows, const ContactState &law, const Tolerance &tolerance,
                         uint32_t i, double h, Vec3 u, const double *l, Residual &r, double &nan_flag) {
  const double normal = normal_residual(rows, i, u.x, l);
  nan_flag += 0.0 * ((u.x + u.y) + (u.z + l[0]));
  r.relative = std::max(r.relative, normal / tolerance.normal[i]);
  r.required = std::max(r.required, normal / tolerance.most_normal);
  r.speed = std::max(r.speed, normal);
  r.normal = std::max(r.normal, normal);
  if (!(rows.wt[i] > 0) || !(l[0] > 0)) return;
  const double tangent = tangent_residual(rows, law, i, h, u, l);
  const double slip = std::sqrt(u.y * u.y + u.z * u.z);
  const double share = tangent / std::max(tolerance.tangent[i], SolveSettings::of_slip * slip);
  r.relative = std::max(r.relative, share);
  r.required = std::max(r.required, share);
  r.speed = std::max(r.speed, tangent);
}

}  // namespace dfm
