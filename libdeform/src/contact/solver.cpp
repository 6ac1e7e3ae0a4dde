#include "contact/solver.h"

#include <algorithm>
#include <limits>

#include "contact/bonds.h"
#include "contact/friction_kernel.h"
#include "contact/solve_settings.h"

namespace dfm {
void set_trial(const ContactRows &rows, const RowsPart &part, double h, const double *response,
               ContactState &s) {
  each_row(part.contacts, [&](uint32_t i) {
    const Vec3 u = rows.velocity(i);
    const double *const l = &rows.impulse[size_t(i) * 3];
    // The law of a contact without impulse gets the normal force that would close it, at least the one that
    // changes its velocity by 1e-6 m/s: its law's limit per normal force must be known, or a contact that
    // opens and closes would lose its friction in every other pass.
    const double wn = rows.wn[i], *const compliance = &rows.compliance[size_t(i) * 3];
    const auto closing = [&] { return normal_impulse(l[0], u.x + rows.rate[i], wn, compliance); };
    s.fn[i] = wn > 0 ? std::max(l[0] > 0 ? l[0] : closing(), 1e-6 / wn) / h : 0;
    s.vt[i] = s.slip[i] = u.y;
    s.vt[s.stride + i] = s.slip[s.stride + i] = u.z;
    const double wt = response[i];
    s.ft_stop[i] = wt > 0 ? (l[1] - u.y / wt) / h : 0;
    s.ft_stop[s.stride + i] = wt > 0 ? (l[2] - u.z / wt) / h : 0;
  });
}

void linearize(const ContactRows &rows, const RowsPart &part, double h, ContactState &s) {
  each_row(part.contacts, [&](uint32_t i) {
    if (s.form[i] == kSmoothLaw) s.linear[i] = linear_law(s, i, h * rows.wt[i]);
  });
}

namespace {

// As the kernel, where impulses at one dof change others.
void solve_contacts(ContactRows &rows, const RowsPart &part, const LawView &law, double h) {
  each_row(part.contacts, [&](uint32_t i) {
    if (!(rows.wn[i] > 0)) return;  // both sides are held: nothing an impulse could change
    const Vec3 u = rows.velocity(i);
    double by[3];
    if (solve_row(rows, law, i, h, {u.x, u.y, u.z}, &rows.impulse[size_t(i) * 3], by))
      rows.apply(i, load3(by));
  });
}

}  // namespace

void sweep(ContactRows &rows, const RowsPart &part, const ContactState &law, double h) {
  if (part.alone)
    for (const RowRun &run : part.contacts)
      rows.kernels().sweep(rows.view(run), law.view(run.first), h, rows.y.data(),
                           rows.impulse.data() + size_t(3) * run.first);
  else solve_contacts(rows, part, law.view(), h);
}

namespace {

// Impulses, and the velocities with them, change by these, one row after the other.
void leap(ContactRows &rows, const RowsPart &part, const double *jumps) {
  const auto change = [&](uint32_t i, Vec3 jump) {
    rows.apply(i, jump);
    double *const l = &rows.impulse[size_t(3) * i];
    store3(l, load3(l) + jump);
  };
  if (part.alone)
    for (const RowRun &run : part.contacts) {
      rows.kernels().leap(rows.view(run), jumps, rows.y.data(), rows.impulse.data() + size_t(3) * run.first);
      jumps += size_t(3) * run.n;
    }
  else
    each_row(part.contacts, [&](uint32_t i) {
      Vec3 jump = load3(jumps);
      jumps += 3;
      // a normal impulse never pulls, not in between either
      jump.x = std::max(jump.x, -rows.impulse[size_t(3) * i]);
      if (jump.x != 0 || jump.y != 0 || jump.z != 0) change(i, jump);
    });
  each_row(part.bonds, [&](uint32_t i) {
    change(i, load3(jumps));
    jumps += 3;
  });
}

}  // namespace

Acceleration::Acceleration(const Memory &m) { use_memory(m, metric_, from_, f_, g_, now_, df_, dg_); }

void Acceleration::start(const ContactRows &rows, const RowsPart &part) {
  const uint32_t values = 3 * part.all();
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
  double *to = metric_.data();
  each_row(part, [&](uint32_t i) {
    to[0] = std::sqrt(rows.wn[i]);
    to[1] = to[2] = std::sqrt(rows.wt[i]);
    to += 3;
  });
  from_.resize(n_);
  for (uint32_t k = values; k < n_; ++k) metric_[k] = from_[k] = 0;
  take_impulses(rows, part, from_.data());
}

void Acceleration::follow(ContactRows &rows, const RowsPart &part) {
  const ContactKernels &loops = rows.kernels();
  take_impulses(rows, part, now_.data());
  std::fill(now_.begin() + std::ptrdiff_t{3} * part.all(), now_.end(), 0.0);
  double *const df = &df_[size_t(next_) * n_], *const dg = &dg_[size_t(next_) * n_];
  loops.differences(n_, metric_.data(), now_.data(), from_.data(), f_.data(), g_.data(),
                    first_ ? nullptr : df, dg);
  double y[kWindow], gamma[kWindow] = {}, both[4];
  loops.dots(n_, f_.data(), df, f_.data(), df, both);  // df is of use where there was an f before
  const double size = both[0];
  // the map has changed under us (contacts opened or began to slip): what was learned is void
  if (!first_ && size > 4 * last_) {
    count_ = next_ = 0;
  } else if (!first_) {
    count_ = std::max(count_, next_ + 1);
    y[next_] = both[2];
    gram_[next_][next_] = both[3];
    // the other columns, two at a time
    for (uint32_t k = 1; k < count_; k += 2) {
      const uint32_t j = (next_ + k) % count_, other = (next_ + std::min(k + 1, count_ - 1)) % count_;
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

  if (count_ > 0 && least_combination(count_, gram_, y, gamma)) {
    loops.combine(n_, count_, gamma, dg_.data(), now_.data());
    leap(rows, part, now_.data());
  }
  take_impulses(rows, part, from_.data());
}

Residual larger(const Residual &a, const Residual &b) {
  return {std::max(a.relative, b.relative), std::max(a.required, b.required), std::max(a.speed, b.speed),
          std::max(a.normal, b.normal)};
}

Residual residual_of(const ContactRows &rows, const RowsPart &part, const ContactState &law, double h,
                     const Tolerance &tolerance) {
  Residual r;
  double nan_flag = 0;
  if (part.alone)
    for (const RowRun &run : part.contacts)
      r = larger(r, rows.kernels().residual(
                        rows.view(run), law.view(run.first),
                        {tolerance.normal + run.first, tolerance.tangent + run.first, tolerance.most_normal},
                        h, rows.y.data(), rows.impulse.data() + size_t(3) * run.first));
  else
    each_row(part.contacts, [&, view = law.view()](uint32_t i) {
      if (!(rows.wn[i] > 0)) return;
      const Vec3 u = rows.velocity(i);
      add_residual(rows, view, tolerance, i, h, {u.x, u.y, u.z}, &rows.impulse[size_t(i) * 3], r, nan_flag);
    });
  each_row(part.bonds, [&](uint32_t row) {
    const double left = norm(bond_residual(rows, row));
    nan_flag += 0.0 * left;
    r.relative = std::max(r.relative, left / tolerance.bond);
    r.required = std::max(r.required, left / tolerance.bond);
    r.speed = std::max(r.speed, left);
  });
  if (nan_flag != 0) r.relative = r.required = std::numeric_limits<double>::infinity();
  return r;
}

double share_of_least_work(const ContactRows &rows, const RowsPart &part) {
  double none = 0, full = 0;  // J, the slope of the function without impulses and with all of them
  const auto add = [&](uint32_t i, Vec3 rate, Vec3 yields) {
    const Vec3 l = load3(&rows.impulse[size_t(3) * i]);
    none += dot(l, rows.velocity(i, rows.y_free.data()) + rate);
    full += dot(l, rows.velocity(i) + rate + yields);
  };
  each_row(part.contacts, [&](uint32_t i) {
    const double l = rows.impulse[size_t(3) * i];
    add(i, {rows.rate[i], 0, 0}, {yield_speed(l, &rows.compliance[size_t(3) * i]), 0, 0});
  });
  each_row(part.bonds, [&](uint32_t i) {
    const ContactRows::BondRow &b = rows.bond[i - rows.n];
    add(i, b.rate, b.soft * load3(&rows.impulse[size_t(3) * i]));
  });
  return full > 0 ? std::clamp(none / (none - full), 0.0, 1.0) : 1;
}

namespace {

// f(entries of the body) for both sides of contact i.
template <class T, class F>
void each_side(const uint32_t *sides, uint32_t i, T *disturbance, F &&f) {
  const uint32_t *const side = sides + 2 * size_t{i};
  if (side[0] != kNone) f(disturbance + 2 * size_t{side[0]});
  if (side[1] != kNone) f(disturbance + 2 * size_t{side[1]});
}

}  // namespace

void find_disturbance(const ContactRows &rows, const RowsPart &part, const ContactState &laws_state, double h,
                      const uint32_t *sides, double *disturbance) {
  const LawView law = laws_state.view();
  each_row(part.contacts, [&](uint32_t i) {
    if (!(rows.wn[i] > 0)) return;
    const Vec3 v = rows.velocity(i);
    const double u[3] = {v.x, v.y, v.z}, *const l = &rows.impulse[size_t(i) * 3];
    const bool friction = rows.wt[i] > 0 && (l[0] > 0 || laws_state.fn[i] > 0);
    const double normal = normal_residual(rows, i, u[0], l);
    const double tangent = friction ? tangent_residual(rows, law, i, h, u, l) : 0;
    each_side(sides, i, disturbance, [&](double *d) {
      d[0] = std::max(d[0], tangent);
      d[1] = std::max({d[1], tangent, normal});
    });
  });
}

void set_tolerance(const ContactRows &rows, const RowsPart &part, std::span<const ContactPoint> contacts,
                   double h, const ToleranceBounds &bounds, const uint32_t *sides, const double *disturbance,
                   Tolerance &tolerance) {
  tolerance.most_normal = bounds.most_normal;
  each_row(part.contacts, [&](uint32_t i) {
    // what a gap is off by where coordinates are large: a few roundings of them
    double normal = bounds.normal;
    if (i < rows.soft()) normal = std::max(normal, 0x1p-49 * norm(load3(contacts[i].point)) / h);
    double tangent = bounds.tangent;
    each_side(sides, i, disturbance, [&](const double *d) {
      tangent = std::max(tangent, SolveSettings::of_start * d[0]);
      normal = std::max(normal, SolveSettings::of_start * d[1]);
    });
    tolerance.normal[i] = std::min(normal, bounds.most_normal);
    tolerance.tangent[i] = tangent;
  });
  // what a bond has left over is part of its gap in the next sub-step
  double change = 0;
  each_row(part.bonds, [&](uint32_t row) { change = std::max(change, norm(bond_residual(rows, row))); });
  tolerance.bond = std::max(bounds.tangent, SolveSettings::of_slip * change);
}

}  // namespace dfm
