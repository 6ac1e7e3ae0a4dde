#include "contact/solver.h"

#include <algorithm>
#include <limits>

#include "contact/bonds.h"
#include "contact/row_law.h"
#include "contact/solve_settings.h"

namespace dfm {
namespace {

// Times what would stop a contact that slides: more than any law's limit.
constexpr double kBeyond = 1e9;

}  // namespace

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
    s.fn[i] = wn > 0 ? std::max(l[0] > 0 ? l[0] : closing(), SolveSettings::at_rest / wn) / h : 0;
    s.vt[i] = s.slip[i] = u.y;
    s.vt[s.stride + i] = s.slip[s.stride + i] = u.z;
    const double wt = response[i], beyond = s.slides[i] ? kBeyond : 1;
    s.ft_stop[i] = wt > 0 ? beyond * (l[1] - u.y / wt) / h : 0;
    s.ft_stop[s.stride + i] = wt > 0 ? beyond * (l[2] - u.z / wt) / h : 0;
  });
}

void linearize(const ContactRows &rows, const RowsPart &part, double h, ContactState &s) {
  each_row(part.contacts, [&](uint32_t i) {
    if (s.form[i] == kSmoothLaw) s.linear[i] = linear_law(s, i, h * rows.wt[i]);
  });
}

void sweep(ContactRows &rows, const RowsPart &part, const ContactState &law, double h) {
  each_row(part.contacts, [&](uint32_t i) {
    if (!(rows.wn[i] > 0)) return;  // both sides are held: nothing an impulse could change
    Vec3 by;
    if (solve_row(rows, law, i, h, rows.velocity(i), &rows.impulse[size_t(i) * 3], by)) rows.apply(i, by);
  });
}

void leap(ContactRows &rows, const RowsPart &part, const double *jumps) {
  const auto change = [&](uint32_t i, Vec3 jump) {
    jumps += 3;
    if (jump.x == 0 && jump.y == 0 && jump.z == 0) return;
    rows.apply(i, jump);
    add3(&rows.impulse[size_t(3) * i], jump);
  };
  each_row(part.contacts, [&](uint32_t i) {
    Vec3 jump = load3(jumps);
    jump.x = std::max(jump.x, -rows.impulse[size_t(3) * i]);
    change(i, jump);
  });
  each_row(part.bonds, [&](uint32_t i) { change(i, load3(jumps)); });
}

Residual larger(const Residual &a, const Residual &b) {
  return {std::max(a.relative, b.relative), std::max(a.required, b.required), std::max(a.speed, b.speed),
          std::max(a.normal, b.normal)};
}

Residual residual_of(const ContactRows &rows, const RowsPart &part, const ContactState &law, double h,
                     const Tolerance &tolerance) {
  Residual r;
  double nan_flag = 0;
  each_row(part.contacts, [&](uint32_t i) {
    if (!(rows.wn[i] > 0)) return;
    add_residual(rows, law, tolerance, i, h, rows.velocity(i), &rows.impulse[size_t(i) * 3], r, nan_flag);
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
  const auto add = [&](uint32_t i, Vec3 rate, Vec3 softness) {
    const Vec3 l = load3(&rows.impulse[size_t(3) * i]);
    none += dot(l, rows.velocity(i, rows.y_free.data()) + rate);
    full += dot(l, rows.velocity(i) + rate + softness);
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
void each_side(const uint32_t *sides, uint32_t i, T *start_residual, F &&f) {
  const uint32_t *const side = sides + 2 * size_t{i};
  if (side[0] != kNone) f(start_residual + 2 * size_t{side[0]});
  if (side[1] != kNone) f(start_residual + 2 * size_t{side[1]});
}

}  // namespace

void find_start_residual(const ContactRows &rows, const RowsPart &part, const ContactState &law, double h,
                         const uint32_t *sides, double *start_residual) {
  each_row(part.contacts, [&](uint32_t i) {
    if (!(rows.wn[i] > 0)) return;
    const Vec3 u = rows.velocity(i);
    const double *const l = &rows.impulse[size_t(i) * 3];
    const bool friction = rows.wt[i] > 0 && (l[0] > 0 || law.fn[i] > 0);
    const double normal = normal_residual(rows, i, u.x, l);
    const double tangent = friction ? tangent_residual(rows, law, i, h, u, l) : 0;
    each_side(sides, i, start_residual, [&](double *d) {
      d[0] = std::max(d[0], tangent);
      d[1] = std::max({d[1], tangent, normal});
    });
  });
}

void set_tolerance(const ContactRows &rows, const RowsPart &part, std::span<const ContactPoint> contacts,
                   double h, const ToleranceBounds &bounds, const uint32_t *sides,
                   const double *start_residual, Tolerance &tolerance) {
  tolerance.most_normal = bounds.most_normal;
  each_row(part.contacts, [&](uint32_t i) {
    // what a gap is off by where coordinates are large: a few roundings of them
    double normal = bounds.normal;
    if (i < rows.soft()) normal = std::max(normal, 0x1p-49 * norm(load3(contacts[i].point)) / h);
    double tangent = bounds.tangent;
    each_side(sides, i, start_residual, [&](const double *d) {
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
