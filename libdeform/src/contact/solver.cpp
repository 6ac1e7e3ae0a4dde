#include "contact/solver.h"

#include <algorithm>
#include <functional>
#include <limits>

namespace dfm {
namespace {

struct Pair { double a, b; };

// Friction impulse that the linearized law wants, given the contact's present impulse (l1, l2), slip (u1, u2)
// and new normal impulse.
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
Pair friction_impulse(const ContactRows &rows, const ContactState &s, uint32_t i, double h, double ln,
                      double u1, double u2) {
  const double wt = rows.wt[i], l1 = rows.impulse[size_t(i) * 3 + 1], l2 = rows.impulse[size_t(i) * 3 + 2];
  const uint32_t n = s.stride;
  const double fn = s.fn[i];
  if (s.form[i] == kSetValuedLaw) {
    const double ratio = fn > 0 ? ln / (h * fn) : 0;
    const double a = l1 - u1 / wt, b = l2 - u2 / wt, size = std::sqrt(a * a + b * b);
    double radius = h * s.limit[i] * ratio;
    if (s.mode[i] == 2) {
      const double growth = std::sqrt(s.dft_dfn[i] * s.dft_dfn[i] + s.dft_dfn[n + i] * s.dft_dfn[n + i]);
      radius = std::max(0.0, h * s.limit[i] + growth * (ln - h * fn));
      const double v1 = s.vt[i], v2 = s.vt[n + i], speed = std::sqrt(v1 * v1 + v2 * v2);
      double slope = 0;
      if (speed > 0) {
        const double e1 = v1 / speed, e2 = v2 / speed;
        slope = std::max(0.0, -(e1 * (s.dft_dvt[i] * e1 + s.dft_dvt[n + i] * e2) +
                                e2 * (s.dft_dvt[2 * n + i] * e1 + s.dft_dvt[3 * n + i] * e2)));
      }
      const double slip = std::max(0.0, wt * (size - radius + h * slope * speed) / (1 + wt * h * slope));
      radius = std::max(0.0, radius + h * slope * (slip - speed));
    }
    if (size <= radius) return {a, b};
    return {radius / size * a, radius / size * b};
  }
  if (s.form[i] == kNoFriction) return {0, 0};
  const auto &[slope, m11, m12, m22, det] = s.linear[i];
  const auto [d11, d12, d22] = slope;
  const double dfn = ln / h - fn;
  const double v1 = u1 - wt * l1 - s.vt[i], v2 = u2 - wt * l2 - s.vt[n + i];
  const double r1 = h * (s.ft[i] + d11 * v1 + d12 * v2 + s.dft_dfn[i] * dfn);
  const double r2 = h * (s.ft[n + i] + d12 * v1 + d22 * v2 + s.dft_dfn[n + i] * dfn);
  Pair l{(m22 * r1 - m12 * r2) / det, (m11 * r2 - m12 * r1) / det};
  const double size = std::sqrt(l.a * l.a + l.b * l.b), radius = fn > 0 ? s.limit[i] / fn * ln : 0;
  const double most = s.mode[i] == 1 ? radius : std::max(radius, h * s.limit[i]);
  if (size > most) l = {most / size * l.a, most / size * l.b};
  return l;
}

double normal_impulse(const ContactRows &rows, uint32_t i, double un) {
  return std::max(0.0, rows.impulse[size_t(i) * 3] - (un + rows.rate[i]) / rows.wn[i]);
}

// m/s, what the impulse of bond k leaves of its condition, in the components in which anything moves.
Vec3 bond_residual(const ContactRows &rows, uint32_t k) {
  const ContactRows::BondRow &b = rows.bond[k];
  Vec3 r = rows.velocity(rows.n + k) + b.rate + b.soft * load3(&rows.impulse[size_t(3) * (rows.n + k)]);
  for (int c = 0; c < 3; ++c)
    if (b.inverse[c][c] == 0) r[c] = 0;
  return r;
}

void sweep_bonds(ContactRows &rows) {
  for (uint32_t k = 0; k < rows.nbond; ++k) {
    const ContactRows::BondRow &b = rows.bond[k];
    const Vec3 r = bond_residual(rows, k);
    const Vec3 change{-dot(b.inverse[0], r), -dot(b.inverse[1], r), -dot(b.inverse[2], r)};
    if (change.x == 0 && change.y == 0 && change.z == 0) continue;
    rows.apply(rows.n + k, change);
    double *const l = &rows.impulse[size_t(3) * (rows.n + k)];
    store3(l, load3(l) + change);
  }
}

}  // namespace

void set_trial(const ContactRows &rows, double h, const double *response, ContactState &s) {
  for (uint32_t i = 0; i < rows.n; ++i) {
    const Vec3 u = rows.velocity(i);
    const double *const l = &rows.impulse[size_t(i) * 3];
    // A contact without impulse is asked at the normal force that would close it alone, and never below what
    // changes its velocity by 1e-6 m/s: its law's limit per normal force must be known, or a contact that
    // opens and closes would lose its friction in every other pass.
    s.fn[i] =
        rows.wn[i] > 0 ? std::max(l[0] > 0 ? l[0] : normal_impulse(rows, i, u.x), 1e-6 / rows.wn[i]) / h : 0;
    s.vt[i] = s.slip[i] = u.y;
    s.vt[s.stride + i] = s.slip[s.stride + i] = u.z;
    const double wt = response[i];
    s.ft_stop[i] = wt > 0 ? (l[1] - u.y / wt) / h : 0;
    s.ft_stop[s.stride + i] = wt > 0 ? (l[2] - u.z / wt) / h : 0;
  }
}

void linearize(const ContactRows &rows, double h, ContactState &s) {
  for (uint32_t i = 0; i < rows.n; ++i) {
    if (s.form[i] != kSmoothLaw) continue;
    const double wt = rows.wt[i];
    ContactState::Linear &l = s.linear[i];
    l.slope = dissipative_slope(s, i);
    l.m11 = 1 - h * wt * l.slope.a;
    l.m22 = 1 - h * wt * l.slope.c;
    l.m12 = -h * wt * l.slope.b;
    l.det = l.m11 * l.m22 - l.m12 * l.m12;
  }
}

void sweep(ContactRows &rows, const ContactState &law, double h) {
  for (uint32_t i = 0; i < rows.n; ++i) {
    if (!(rows.wn[i] > 0)) continue;  // both sides are held: nothing an impulse could change
    double *const l = &rows.impulse[size_t(i) * 3];
    const Vec3 u = rows.velocity(i);
    const double ln = normal_impulse(rows, i, u.x), d = ln - l[0];
    if (ln == 0 && l[0] == 0 && l[1] == 0 && l[2] == 0) continue;
    Pair t{0, 0};
    if (ln > 0 && rows.wt[i] > 0)
      t = friction_impulse(rows, law, i, h, ln, u.y + rows.cross[2 * size_t(i)] * d,
                           u.z + rows.cross[2 * size_t(i) + 1] * d);
    if (d == 0 && t.a == l[1] && t.b == l[2]) continue;
    rows.apply(i, {d, t.a - l[1], t.b - l[2]});
    l[0] = ln;
    l[1] = t.a;
    l[2] = t.b;
  }
  if (rows.nbond) sweep_bonds(rows);
}

Acceleration::Acceleration(const Memory &m) { use_memory(m, metric_, from_, f_, g_, now_, df_, dg_); }

namespace {

// Columns are padded with zeros to whole fours; a sum has four partial sums at every vector width. They are
// held as two pairs, which every x86-64 keeps in registers.
using Two = double __attribute__((vector_size(16)));

struct Sum {
  Two low = {0, 0}, high = {0, 0};
  double all() const { return (low[0] + low[1]) + (high[0] + high[1]); }
};

const Two *pairs(const double *a) { return reinterpret_cast<const Two *>(a); }

double dot(const double *a, const double *b, uint32_t n) {
  const Two *const x = pairs(a), *const y = pairs(b);
  Sum sum;
  for (uint32_t k = 0; k < n / 2; k += 2) {
    sum.low += x[k] * y[k];
    sum.high += x[k + 1] * y[k + 1];
  }
  return sum.all();
}

// a.y, a.z, b.y and b.z, each as dot() has it: one sum waits for itself at every addition, four go on side
// by side.
void dots(const double *a, const double *b, const double *y, const double *z, uint32_t n, double out[4]) {
  const Two *const p = pairs(a), *const q = pairs(b), *const u = pairs(y), *const v = pairs(z);
  Sum ay, az, by, bz;
  for (uint32_t k = 0; k < n / 2; k += 2) {
    ay.low += p[k] * u[k];
    az.low += p[k] * v[k];
    by.low += q[k] * u[k];
    bz.low += q[k] * v[k];
    ay.high += p[k + 1] * u[k + 1];
    az.high += p[k + 1] * v[k + 1];
    by.high += q[k + 1] * u[k + 1];
    bz.high += q[k + 1] * v[k + 1];
  }
  out[0] = ay.all();
  out[1] = az.all();
  out[2] = by.all();
  out[3] = bz.all();
}

}  // namespace

void Acceleration::start(const ContactRows &rows) {
  const uint32_t values = 3 * rows.all();
  n_ = (values + 3) & ~3u;
  count_ = next_ = 0;
  first_ = true;
  last_ = 0;
  metric_.resize(n_);
  f_.resize(n_);
  g_.resize(n_);
  now_.resize(n_);
  df_.resize(size_t(kWindow) * n_);
  dg_.resize(size_t(kWindow) * n_);
  for (uint32_t i = 0; i < rows.all(); ++i) {
    metric_[3 * i] = std::sqrt(rows.wn[i]);
    metric_[3 * i + 1] = metric_[3 * i + 2] = std::sqrt(rows.wt[i]);
  }
  for (uint32_t k = values; k < n_; ++k) metric_[k] = 0;
  from_.assign(n_, 0.0);
  std::copy(rows.impulse.begin(), rows.impulse.end(), from_.begin());
}

void Acceleration::follow(ContactRows &rows) {
  std::fill(now_.begin(), now_.end(), 0.0);
  std::copy(rows.impulse.begin(), rows.impulse.end(), now_.begin());
  double *const df = &df_[size_t(next_) * n_], *const dg = &dg_[size_t(next_) * n_];
  const auto pair = [](double *a, uint32_t k) -> Two & { return reinterpret_cast<Two *>(a)[k]; };
  for (uint32_t k = 0; k < n_ / 2; ++k) {
    const Two g = pair(now_.data(), k);
    const Two f = pair(metric_.data(), k) * (g - pair(from_.data(), k));
    if (!first_) {
      pair(df, k) = f - pair(f_.data(), k);
      pair(dg, k) = g - pair(g_.data(), k);
    }
    pair(f_.data(), k) = f;
    pair(g_.data(), k) = g;
  }
  const double size = dot(f_.data(), f_.data(), n_);
  double y[kWindow], gamma[kWindow] = {};
  // the map has changed under us (contacts opened or began to slip): what was learned is void
  if (!first_ && size > 4 * last_) {
    count_ = next_ = 0;
  } else if (!first_) {
    count_ = std::max(count_, next_ + 1);
    for (uint32_t j = 0; j < count_; j += 2) {
      const uint32_t other = std::min(j + 1, count_ - 1);
      double both[4];
      dots(&df_[size_t(j) * n_], &df_[size_t(other) * n_], df, f_.data(), n_, both);
      gram_[j][next_] = gram_[next_][j] = both[0];
      gram_[other][next_] = gram_[next_][other] = both[2];
      y[j] = both[1];
      y[other] = both[3];
    }
    next_ = (next_ + 1) % kWindow;
  }
  first_ = false;
  last_ = size;

  if (count_ > 0 && least_combination(count_, gram_, y, gamma)) {
    for (uint32_t k = 0; k < n_ / 2; ++k) {
      Two sum{0, 0};
      for (uint32_t j = 0; j < count_; ++j) sum -= gamma[j] * pair(&dg_[size_t(j) * n_], k);
      pair(now_.data(), k) = sum;
    }
    for (uint32_t i = 0; i < rows.n; ++i) {
      Vec3 jump = load3(&now_[size_t(3) * i]);
      // a normal impulse never pulls, not in between either
      jump.x = std::max(jump.x, -rows.impulse[3 * i]);
      if (jump.x == 0 && jump.y == 0 && jump.z == 0) continue;
      rows.apply(i, jump);
      for (uint32_t c = 0; c < 3; ++c) rows.impulse[3 * i + c] += jump[int(c)];
    }
    for (uint32_t i = rows.n; i < rows.all(); ++i) {
      const Vec3 jump = load3(&now_[size_t(3) * i]);
      rows.apply(i, jump);
      double *const l = &rows.impulse[size_t(3) * i];
      store3(l, load3(l) + jump);
    }
  }
  std::copy(rows.impulse.begin(), rows.impulse.end(), from_.begin());
}

namespace {

double normal_residual(const ContactRows &rows, uint32_t i, Vec3 u) {
  return std::fabs(std::min(rows.wn[i] * rows.impulse[size_t(i) * 3], u.x + rows.rate[i]));
}

double tangent_residual(const ContactRows &rows, uint32_t i, Pair law) {
  const double a = law.a - rows.impulse[size_t(i) * 3 + 1], b = law.b - rows.impulse[size_t(i) * 3 + 2];
  return rows.wt[i] * std::sqrt(a * a + b * b);
}

// What the laws, asked at the present state, want contact i to carry. They are compared by the answer they
// give together with the contact's own response, not by the bare force: the difference is then the velocity
// that is left to correct. Where a set-valued law just slips, force and slip may differ in direction by much
// while that is tiny; a smooth law with a steep slope c would count it 1 + h w_t c times.
Pair answered(const ContactRows &rows, const ContactState &s, uint32_t i, double h, Vec3 u) {
  return friction_impulse(rows, s, i, h, rows.impulse[size_t(i) * 3], u.y, u.z);
}

Residual with_bonds(const ContactRows &rows, const Tolerance &tolerance, Residual r) {
  double poison = 0;
  for (uint32_t k = 0; k < rows.nbond; ++k) {
    const double left = norm(bond_residual(rows, k));
    poison += 0.0 * left;
    r.relative = std::max(r.relative, left / tolerance.bond);
    r.due = std::max(r.due, left / tolerance.bond);
    r.speed = std::max(r.speed, left);
  }
  if (poison != 0) r.relative = r.due = std::numeric_limits<double>::infinity();
  return r;
}

// Of the contacts which(0) to which(n - 1); law(i, u) gives the friction impulse that contact i should carry.
template <class Which, class Law>
Residual residual(const ContactRows &rows, const Tolerance &tolerance, uint32_t n, Which which, Law law) {
  Residual r;
  double poison = 0;
  for (uint32_t k = 0; k < n; ++k) {
    const uint32_t i = which(k);
    if (!(rows.wn[i] > 0)) continue;
    const double *const l = &rows.impulse[size_t(i) * 3];
    const Vec3 u = rows.velocity(i);
    const double normal = normal_residual(rows, i, u);
    poison += 0.0 * ((u.x + u.y) + (u.z + l[0]));
    r.relative = std::max(r.relative, normal / tolerance.normal[i]);
    r.due = std::max(r.due, normal / tolerance.most_normal);
    r.speed = std::max(r.speed, normal);
    r.normal = std::max(r.normal, normal);
    if (!(rows.wt[i] > 0) || !(l[0] > 0)) continue;
    const Pair t = law(i, u);
    const double tangent = tangent_residual(rows, i, t);
    const double allowed = std::max(tolerance.tangent[i], 1e-3 * std::sqrt(u.y * u.y + u.z * u.z));
    r.relative = std::max(r.relative, tangent / allowed);
    r.due = std::max(r.due, tangent / allowed);
    r.speed = std::max(r.speed, tangent);
  }
  // max() passes over what is no number
  if (poison != 0) r.relative = r.due = std::numeric_limits<double>::infinity();
  return r;
}

}  // namespace

Residual inner_residual(const ContactRows &rows, const ContactState &law, double h,
                        const Tolerance &tolerance) {
  const Residual r = residual(rows, tolerance, rows.n, std::identity(), [&](uint32_t i, Vec3 u) {
    return friction_impulse(rows, law, i, h, rows.impulse[size_t(i) * 3], u.y, u.z);
  });
  return rows.nbond ? with_bonds(rows, tolerance, r) : r;
}

Residual inner_residual(const ContactRows &rows, const ContactState &law, double h,
                        const Tolerance &tolerance, std::span<const uint32_t> contacts) {
  return residual(
      rows, tolerance, static_cast<uint32_t>(contacts.size()), [&](uint32_t k) { return contacts[k]; },
      [&](uint32_t i, Vec3 u) {
        return friction_impulse(rows, law, i, h, rows.impulse[size_t(i) * 3], u.y, u.z);
      });
}

Residual true_residual(const ContactRows &rows, const ContactState &answer, double h,
                       const Tolerance &tolerance) {
  const Residual r = residual(rows, tolerance, rows.n, std::identity(),
                              [&](uint32_t i, Vec3 u) { return answered(rows, answer, i, h, u); });
  return rows.nbond ? with_bonds(rows, tolerance, r) : r;
}

void set_tolerance(const ContactRows &rows, const ContactState &answer,
                   std::span<const ContactPoint> contacts, double h, const ToleranceBounds &bounds,
                   uint32_t bodies, Array<double> &disturbance, Tolerance &tolerance) {
  disturbance.assign(2 * size_t{bodies}, 0.0);
  auto visit = [&](uint32_t i, auto f) {
    f(&disturbance[2 * size_t{contacts[i].slot_a}]);
    if (!contacts[i].obstacle) f(&disturbance[2 * size_t{contacts[i].slot_b}]);
  };
  for (uint32_t i = 0; i < rows.n; ++i) {
    if (!(rows.wn[i] > 0)) continue;
    const Vec3 u = rows.velocity(i);
    const bool rubs = rows.wt[i] > 0 && (rows.impulse[size_t(i) * 3] > 0 || answer.fn[i] > 0);
    const double normal = normal_residual(rows, i, u);
    const double tangent = rubs ? tangent_residual(rows, i, answered(rows, answer, i, h, u)) : 0;
    visit(i, [&](double *d) {
      d[0] = std::max(d[0], tangent);
      d[1] = std::max({d[1], tangent, normal});
    });
  }
  tolerance.most_normal = bounds.most_normal;
  tolerance.normal.resize(rows.n);
  tolerance.tangent.resize(rows.n);
  for (uint32_t i = 0; i < rows.n; ++i) {
    // what a gap is off by where coordinates are large: a few roundings of them
    double normal = std::max(bounds.normal, 0x1p-49 * norm(load3(contacts[i].point)) / h);
    double tangent = bounds.tangent;
    visit(i, [&](const double *d) {
      tangent = std::max(tangent, 1e-2 * d[0]);
      normal = std::max(normal, 2e-2 * d[1]);
    });
    tolerance.normal[i] = std::min(normal, bounds.most_normal);
    tolerance.tangent[i] = tangent;
  }
  // what a bond has left over is part of its gap in the next sub-step
  double change = 0;
  for (uint32_t k = 0; k < rows.nbond; ++k) change = std::max(change, norm(bond_residual(rows, k)));
  tolerance.bond = std::max(bounds.tangent, 1e-3 * change);
}

}  // namespace dfm
