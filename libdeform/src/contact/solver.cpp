#include "contact/solver.h"

#include <algorithm>
#include <functional>
#include <limits>

#include "contact/bonds.h"
#include "contact/friction_kernel.h"

namespace dfm {
namespace {

// Contact i as the rows have it.
Pair friction_impulse(const ContactRows &rows, const LawView &law, uint32_t i, double h, double ln, double u1,
                      double u2) {
  const double *const l = &rows.impulse[size_t(i) * 3];
  return friction_impulse(law, i, h, rows.wt[i], l[1], l[2], ln, u1, u2);
}

double normal_impulse(const ContactRows &rows, uint32_t i, double un) {
  return std::max(0.0, rows.impulse[size_t(i) * 3] - (un + rows.rate[i]) / rows.wn[i]);
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
    LinearLaw &l = s.linear[i];
    l.slope = dissipative_slope(s, i);
    l.m11 = 1 - h * wt * l.slope.a;
    l.m22 = 1 - h * wt * l.slope.c;
    l.m12 = -h * wt * l.slope.b;
    l.det = l.m11 * l.m22 - l.m12 * l.m12;
  }
}

namespace {

// As the kernel, where impulses at one dof change others. kLeaves: with `leave`.
template <bool kLeaves>
void sweep_answers(ContactRows &rows, const LawView &law, double h, double leave) {
  for (uint32_t i = 0; i < rows.n; ++i) {
    if (!(rows.wn[i] > 0)) continue;  // both sides are held: nothing an impulse could change
    double *const l = &rows.impulse[size_t(i) * 3];
    const Vec3 u = rows.velocity(i);
    const bool stays = kLeaves && std::fabs(u.x + rows.rate[i]) <= leave;
    const double ln = stays ? l[0] : normal_impulse(rows, i, u.x), d = ln - l[0];
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
}

}  // namespace

uint32_t sweep(ContactRows &rows, const ContactState &law, double h, double bond_tolerance, double leave) {
  if (!rows.alone_all() && leave > 0) sweep_answers<true>(rows, law.view(), h, leave);
  else if (!rows.alone_all()) sweep_answers<false>(rows, law.view(), h, 0);
  else rows.kernels().sweep(rows.view(), law.view(), h, rows.y.data(), rows.impulse.data());
  return rows.nbond ? solve_bonds(rows, bond_tolerance) : 0;
}

namespace {

void leap_answers(ContactRows &rows, const double *jumps) {
  for (uint32_t i = 0; i < rows.n; ++i) {
    Vec3 jump = load3(jumps + size_t(3) * i);
    // a normal impulse never pulls, not in between either
    jump.x = std::max(jump.x, -rows.impulse[size_t(3) * i]);
    if (jump.x == 0 && jump.y == 0 && jump.z == 0) continue;
    rows.apply(i, jump);
    double *const l = &rows.impulse[size_t(3) * i];
    store3(l, load3(l) + jump);
  }
}

// Impulses, and the velocities with them, change by these.
void leap(ContactRows &rows, const double *jumps) {
  if (!rows.alone_all()) leap_answers(rows, jumps);
  else rows.kernels().leap(rows.view(), jumps, rows.y.data(), rows.impulse.data());
  for (uint32_t i = rows.n; i < rows.all(); ++i) {
    const Vec3 jump = load3(jumps + size_t(3) * i);
    rows.apply(i, jump);
    double *const l = &rows.impulse[size_t(3) * i];
    store3(l, load3(l) + jump);
  }
}

}  // namespace

Acceleration::Acceleration(const Memory &m) { use_memory(m, metric_, from_, f_, g_, now_, df_, dg_); }

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

void Acceleration::follow(ContactRows &rows, bool leaps) {
  const ContactKernels &loops = rows.kernels();
  std::fill(now_.begin(), now_.end(), 0.0);
  std::copy(rows.impulse.begin(), rows.impulse.end(), now_.begin());
  double *const df = &df_[size_t(next_) * n_], *const dg = &dg_[size_t(next_) * n_];
  loops.differences(n_, metric_.data(), now_.data(), from_.data(), f_.data(), g_.data(),
                    first_ ? nullptr : df, dg);
  double y[kWindow], gamma[kWindow] = {}, both[4];
  loops.dots(n_, f_.data(), f_.data(), f_.data(), f_.data(), both);
  const double size = both[0];
  // the map has changed under us (contacts opened or began to slip): what was learned is void
  if (!first_ && size > 4 * last_) {
    count_ = next_ = 0;
  } else if (!first_) {
    count_ = std::max(count_, next_ + 1);
    for (uint32_t j = 0; j < count_; j += 2) {
      const uint32_t other = std::min(j + 1, count_ - 1);
      loops.dots(n_, &df_[size_t(j) * n_], &df_[size_t(other) * n_], df, f_.data(), both);
      gram_[j][next_] = gram_[next_][j] = both[0];
      gram_[other][next_] = gram_[next_][other] = both[2];
      y[j] = both[1];
      y[other] = both[3];
    }
    next_ = (next_ + 1) % kWindow;
  }
  first_ = false;
  last_ = size;

  if (leaps && count_ > 0 && least_combination(count_, gram_, y, gamma)) {
    loops.combine(n_, count_, gamma, dg_.data(), now_.data());
    leap(rows, now_.data());
  }
  std::copy(rows.impulse.begin(), rows.impulse.end(), from_.begin());
}

Momentum::Momentum(const Memory &m) { use_memory(m, from_, last_, jump_); }

void Momentum::start(const ContactRows &rows) {
  age_ = 0;
  from_.assign(rows.impulse.begin(), rows.impulse.end());
  last_.assign(rows.impulse.begin(), rows.impulse.end());
}

void Momentum::follow(ContactRows &rows) {
  const uint32_t values = 3 * rows.all();
  double along = 0;
  for (uint32_t k = 0; k < values; ++k) {
    const double x = rows.impulse[k];
    along += (k % 3 == 0 ? rows.wn[k / 3] : rows.wt[k / 3]) * (x - from_[k]) * (x - last_[k]);
  }
  age_ = along < 0 ? 1 : age_ + 1;
  jump_.resize(values);
  for (uint32_t k = 0; k < values; ++k)
    jump_[k] = double(age_ - 1) / double(age_ + 2) * (rows.impulse[k] - last_[k]);
  last_.assign(rows.impulse.begin(), rows.impulse.end());
  leap(rows, jump_.data());
  from_.assign(rows.impulse.begin(), rows.impulse.end());
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
Pair answered(const ContactRows &rows, const LawView &s, uint32_t i, double h, Vec3 u) {
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
  const LawView view = law.view();
  const Residual r =
      rows.alone_all()
          ? rows.kernels().residual(
                rows.view(), view, {tolerance.normal.data(), tolerance.tangent.data(), tolerance.most_normal},
                h, rows.y.data(), rows.impulse.data())
          : residual(rows, tolerance, rows.n, std::identity(),
                     [&](uint32_t i, Vec3 u) { return answered(rows, view, i, h, u); });
  return rows.nbond ? with_bonds(rows, tolerance, r) : r;
}

Residual inner_residual(const ContactRows &rows, const ContactState &law, double h,
                        const Tolerance &tolerance, std::span<const uint32_t> contacts) {
  const LawView view = law.view();
  return residual(
      rows, tolerance, static_cast<uint32_t>(contacts.size()), [&](uint32_t k) { return contacts[k]; },
      [&](uint32_t i, Vec3 u) { return answered(rows, view, i, h, u); });
}

// What a law says at the state in which it was asked, the sweeps make of it there.
Residual true_residual(const ContactRows &rows, const ContactState &answer, double h,
                       const Tolerance &tolerance) {
  return inner_residual(rows, answer, h, tolerance);
}

void set_tolerance(const ContactRows &rows, const ContactState &answer,
                   std::span<const ContactPoint> contacts, double h, const ToleranceBounds &bounds,
                   uint32_t bodies, Array<double> &disturbance, Tolerance &tolerance) {
  const LawView law = answer.view();
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
    const double tangent = rubs ? tangent_residual(rows, i, answered(rows, law, i, h, u)) : 0;
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
