#include "contact/augmented.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/linear_law.h"
#include "math/block3.h"

namespace dfm {
namespace {

// Penalties are this many times what makes a contact's impulse by itself. More lets the multipliers converge
// in fewer updates, each of them in more iterations.
constexpr double kPenalty = 3;
constexpr uint32_t kMostGradients = 1000;
// A system is solved to this share of the Newton residual that it starts from.
constexpr double kForcing = 0.1;
// The Newton residual goes down to this share of what the multipliers are still off by.
constexpr double kInner = 0.3;

// Of what may be left; the rest is for the rigid motions that take the remainder of momentum in the end.
constexpr double kKept = 0.0625;

using Four = double __attribute__((vector_size(32)));
Four *fours(Array<double> &a) { return reinterpret_cast<Four *>(a.data()); }
const Four *fours(const Array<double> &a) { return reinterpret_cast<const Four *>(a.data()); }

double product(const Array<double> &a, const Array<double> &b) {
  Four sum{0, 0, 0, 0};
  const Four *const x = fours(a), *const y = fours(b);
  for (size_t k = 0; k < a.size() / 4; ++k) sum += x[k] * y[k];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

// a += s b
void add(Array<double> &a, double s, const Array<double> &b) {
  for (size_t k = 0; k < a.size() / 4; ++k) fours(a)[k] += s * fours(b)[k];
}

// Inverse of a symmetric positive definite block on the components that move; zero on the others.
void invert(const double *block, const double *moves, double *out) {
  double m[9];
  for (uint32_t r = 0; r < 3; ++r)
    for (uint32_t c = 0; c < 3; ++c)
      m[3 * r + c] = moves[r] > 0 && moves[c] > 0 ? block[3 * r + c] : r == c ? 1 : 0;
  inverse3(m, out);
  for (uint32_t k = 0; k < 9; ++k)
    if (!(moves[k / 3] > 0 && moves[k % 3] > 0)) out[k] = 0;
}

// C of a contact times a velocity in its frame.
Vec3 resist(const double *slope, Vec3 u) {
  return {slope[0] * u.x, slope[1] * u.y + slope[2] * u.z, slope[2] * u.y + slope[3] * u.z};
}

}  // namespace

AugmentedSolve::AugmentedSolve(const Memory &m) : updates_(m), rigid_(m) {
  use_memory(m, place_, local_, pn_, pt_, inverse_, touched_, normal_, answer_, slope_, speed_, change_,
             seen_, given_, last_, off_, metric_, force_, r_, z_, p_, ap_, d_, ad_);
}

void AugmentedSolve::respond(const MatrixPoints &points, double *out) {
  for (uint32_t i = 0; i < points.n; ++i) {
    double inverse[9];
    invert(points.blocks + size_t(9) * i, points.moves + size_t(4) * i, inverse);
    store3(out + size_t(4) * i, {inverse[0], inverse[4], inverse[8]});
    out[size_t(4) * i + 3] = 0;
  }
  rigid_.find_bodies(points);
  rigid_.add_response(points, out);
}

void AugmentedSolve::start(const ContactRows &rows, const MatrixPoints &points,
                           std::span<const uint32_t> place) {
  n_ = points.n;
  ndof_ = rows.ndof;
  place_.assign(place.begin(), place.end());
  const size_t all = 4 * (size_t(n_) + ndof_);
  for (Vector *v : {&force_, &r_, &z_, &p_, &ap_, &d_, &ad_}) v->assign(all, 0.0);
  for (Array<double> *a : {&seen_, &given_}) a->assign(size_t(4) * ndof_, 0.0);
  local_.resize(size_t(9) * n_);
  inverse_.resize(size_t(9) * n_);
  touched_.resize(size_t(9) * ndof_);
  for (uint32_t i = 0; i < n_; ++i)
    invert(points.blocks + size_t(9) * i, points.moves + size_t(4) * i, &local_[size_t(9) * i]);
  for (Array<double> *a : {&pn_, &pt_, &normal_}) a->resize(rows.n);
  for (Array<double> *a : {&answer_, &speed_, &change_, &last_, &off_, &metric_})
    a->resize(size_t(3) * rows.n);
  penalties(rows);
  rigid_.start(rows, points, place);
  slope_.assign(size_t(4) * rows.n, 0.0);
  factor(rows, points);
}

// By the points' own blocks, not by A^-1: a penalty much above them would ruin the conditioning of the
// system.
void AugmentedSolve::penalties(const ContactRows &rows) {
  for (uint32_t i = 0; i < rows.n; ++i) {
    const double *const f = &rows.frame[size_t(i) * 9];
    double far[3] = {0, 0, 0}, near[3] = {0, 0, 0};
    for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j) {
      const uint32_t d = rows.dof[j];
      if (place_[d] == kNone) continue;
      const double ww = rows.weight[j] * rows.weight[j];
      for (uint32_t axis = 0; axis < 3; ++axis) {
        const Vec3 e = load3(f + 3 * size_t(axis)), w = load3(&rows.alone[size_t(d) * 4]);
        far[axis] += ww * (w.x * e.x * e.x + w.y * e.y * e.y + w.z * e.z * e.z);
        near[axis] += ww * dot(e, times3(&local_[size_t(9) * place_[d]], e));
      }
    }
    pn_[i] = (std::max(0.0, rows.wn[i] - far[0]) + near[0]) / kPenalty;
    pt_[i] = (std::max(0.0, rows.wt[i] - std::max(far[1], far[2])) + std::max(near[1], near[2])) / kPenalty;
  }
}

void AugmentedSolve::gather(const double *v) {
  for (uint32_t d = 0; d < ndof_; ++d) {
    const size_t from = place_[d] == kNone ? size_t(n_) + d : place_[d];
    fours(seen_)[d] = reinterpret_cast<const Four *>(v)[from];
  }
}

// answer_ and slope_ at speed_.
void AugmentedSolve::answers(const ContactRows &rows, const ContactState &law, double h, bool slopes) {
  for (uint32_t i = 0; i < rows.n; ++i) {
    const double *const l = &rows.impulse[size_t(i) * 3], *const u = &speed_[size_t(i) * 3];
    double *const to = &answer_[size_t(i) * 3], *const c = &slope_[size_t(i) * 4];
    to[0] = to[1] = to[2] = 0;
    if (slopes) c[0] = c[1] = c[2] = c[3] = 0;
    if (!(rows.wn[i] > 0)) continue;
    to[0] = std::max(0.0, l[0] - (u[0] + rows.rate[i]) / pn_[i]);
    if (slopes && to[0] > 0) c[0] = 1 / pn_[i];
    if (!(rows.wt[i] > 0) || !(normal_[i] > 0)) continue;
    FrictionSlope slope;
    const Tangential t = friction_impulse(law, i, h, pt_[i], {l[1], l[2]}, {u[1], u[2]}, normal_[i],
                                          slopes ? &slope : nullptr);
    to[1] = t.a;
    to[2] = t.b;
    if (!slopes) continue;
    c[1] = slope.a;
    c[2] = slope.b;
    c[3] = slope.c;
  }
}

// r_ = load + J^T l - A v
void AugmentedSolve::residual(const ContactRows &rows, const MatrixPoints &points) {
  std::fill(given_.begin(), given_.end(), 0.0);
  for (uint32_t i = 0; i < rows.n; ++i) {
    const Vec3 l = load3(&answer_[size_t(i) * 3]);
    if (l.x != 0 || l.y != 0 || l.z != 0) rows.spread(i, l, given_.data());
  }
  for (size_t k = 0; k < r_.size() / 4; ++k) fours(r_)[k] = -fours(force_)[k];
  for (uint32_t d = 0; d < ndof_; ++d)
    fours(r_)[place_[d] == kNone ? size_t(n_) + d : place_[d]] += fours(given_)[d];
  for (size_t k = 0; k < size_t(4) * n_; ++k) r_[k] *= points.moves[k];
}

void AugmentedSolve::factor(const ContactRows &rows, const MatrixPoints &points) {
  std::fill(touched_.begin(), touched_.end(), 0.0);
  for (uint32_t i = 0; i < rows.n; ++i) {
    const double *const c = &slope_[size_t(i) * 4], *const f = &rows.frame[size_t(i) * 9];
    if (!(c[0] > 0 || c[1] > 0 || c[3] > 0)) continue;
    double m[9];
    for (uint32_t r = 0; r < 3; ++r)
      for (uint32_t k = 0; k < 3; ++k)
        m[3 * r + k] = c[0] * f[r] * f[k] + f[3 + r] * (c[1] * f[3 + k] + c[2] * f[6 + k]) +
                       f[6 + r] * (c[2] * f[3 + k] + c[3] * f[6 + k]);
    for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j)
      for (uint32_t k = 0; k < 9; ++k)
        touched_[size_t(9) * rows.dof[j] + k] += rows.weight[j] * rows.weight[j] * m[k];
  }
  inverse_.assign(local_.begin(), local_.end());
  for (uint32_t d = 0; d < ndof_; ++d) {
    if (place_[d] == kNone) continue;
    double m[9];
    for (uint32_t k = 0; k < 9; ++k)
      m[k] = points.blocks[size_t(9) * place_[d] + k] + touched_[size_t(9) * d + k];
    invert(m, points.moves + size_t(4) * place_[d], &inverse_[size_t(9) * place_[d]]);
  }
  rigid_.factor(rows, slope_.data());
}

double AugmentedSolve::precondition(const ContactRows &rows, const MatrixPoints &points) {
  double most = 0, poison = 0;
  for (uint32_t i = 0; i < n_; ++i) {
    const Vec3 z = times3(&inverse_[size_t(9) * i], load3(&r_[size_t(4) * i]));
    store3(&z_[size_t(4) * i], z);
    const double size = norm2(z);
    poison += 0.0 * size;
    most = std::max(most, size);
  }
  const double rigid = rigid_.precondition(points, r_.data(), z_.data());
  most = std::max(most, rigid * rigid);
  double *const z = &z_[size_t(4) * n_];
  const double *const r = &r_[size_t(4) * n_];
  for (uint32_t d = 0; d < ndof_; ++d) {
    if (place_[d] != kNone || rows.block[d] != kNone) continue;
    const double *const w = &rows.alone[size_t(4) * d];
    for (uint32_t k = 0; k < 3; ++k) z[4 * d + k] = w[k] * r[4 * d + k];
    most = std::max(most, norm2(load3(z + 4 * d)));
  }
  for (const ContactRows::Block &b : rows.blocks) {
    const size_t width = size_t(3) * b.count;
    const double *m = &rows.response[b.response];
    for (size_t row = 0; row < width; ++row, m += width) {
      double sum = 0;
      for (size_t k = 0; k < width; ++k) sum += m[k] * r[4 * (b.first + k / 3) + k % 3];
      z[4 * (b.first + row / 3) + row % 3] = sum;
      poison += 0.0 * sum;
    }
    for (uint32_t k = 0; k < b.count; ++k) most = std::max(most, norm2(load3(z + 4 * (b.first + k))));
  }
  return poison == 0 ? std::sqrt(most) : std::numeric_limits<double>::infinity();
}

// d_ with (A + J^T C J) d = r, and ad_ = A d. z_ is P r_, its largest `first`; stops at `target`.
uint32_t AugmentedSolve::gradients(const ContactRows &rows, const MatrixPoints &points, double first,
                                   double target) {
  std::fill(d_.begin(), d_.end(), 0.0);
  std::fill(ad_.begin(), ad_.end(), 0.0);
  p_.assign(z_.begin(), z_.end());
  // of dofs, ap_ is the residual that p_ is made of
  std::copy(r_.begin() + 4 * ptrdiff_t(n_), r_.end(), ap_.begin() + 4 * ptrdiff_t(n_));
  double rz = product(r_, z_);
  uint32_t k = 0;
  for (double size = first; k < kMostGradients && size > target; ++k) {
    points.multiply(p_.data(), ap_.data());
    for (size_t j = 0; j < size_t(4) * n_; ++j) ap_[j] *= points.moves[j];
    gather(p_.data());
    std::fill(given_.begin(), given_.end(), 0.0);
    double bent = 0;
    for (uint32_t i = 0; i < rows.n; ++i) {
      const double *const c = &slope_[size_t(i) * 4];
      if (!(c[0] > 0 || c[1] > 0 || c[3] > 0)) continue;
      const Vec3 u = rows.relative(i, seen_.data()), f = resist(c, u);
      bent += dot(u, f);
      rows.spread(i, f, given_.data());
    }
    const double pq = product(p_, ap_) + bent;
    if (!(pq > 0)) break;
    const double alpha = rz / pq;
    add(d_, alpha, p_);
    add(ad_, alpha, ap_);
    add(r_, -alpha, ap_);
    for (uint32_t d = 0; d < ndof_; ++d) {
      const size_t at = place_[d] == kNone ? size_t(n_) + d : place_[d];
      fours(r_)[at] -= alpha * fours(given_)[d];
    }
    for (uint32_t d = 0; d < ndof_; ++d)
      for (uint32_t c = 0; place_[d] != kNone && c < 3; ++c)
        r_[size_t(4) * place_[d] + c] *= points.moves[size_t(4) * place_[d] + c];
    size = precondition(rows, points);
    const double next = product(r_, z_);
    const double beta = next / rz;
    rz = next;
    for (size_t j = 0; j < p_.size() / 4; ++j) fours(p_)[j] = fours(z_)[j] + beta * fours(p_)[j];
    for (size_t j = n_; j < p_.size() / 4; ++j) fours(ap_)[j] = fours(r_)[j] + beta * fours(ap_)[j];
  }
  return k;
}

// How far to go along d_: to the root of the energy's slope, which is monotone. Leaves speed_ there.
double AugmentedSolve::search(const ContactRows &rows, const ContactState &law, double h) {
  gather(d_.data());
  for (uint32_t i = 0; i < rows.n; ++i) store3(&change_[size_t(i) * 3], rows.relative(i, seen_.data()));
  const double curve = product(d_, ad_);
  double start = 0, at_start = 0;  // of the contacts' part
  const auto by_contacts = [&] {
    double sum = 0;
    for (size_t k = 0; k < answer_.size(); ++k) sum += answer_[k] * change_[k];
    return sum;
  };
  start = by_contacts();
  at_start = -product(force_, d_) + start;  // minus the slope: > 0
  double here = 0;
  const auto slope = [&](double t) {
    for (size_t k = 0; k < speed_.size(); ++k) speed_[k] += (t - here) * change_[k];
    here = t;
    answers(rows, law, h, false);
    return at_start - t * curve + (by_contacts() - start);
  };
  double high = slope(1);
  if (high >= -0.5 * at_start || !(at_start > 0)) return 1;
  double a = 0, b = 1, low = at_start;
  for (uint32_t k = 0; k < 30; ++k) {
    double t = a + (b - a) * (low / (low - high));
    t = std::min(std::max(t, a + 0.01 * (b - a)), b - 0.01 * (b - a));
    const double now = slope(t);
    if (std::fabs(now) <= 0.1 * at_start) return t;
    if (now > 0) {
      a = t;
      low = now;
      high *= 0.5;
    } else {
      b = t;
      high = now;
      low *= 0.5;
    }
  }
  return here;
}

// The impulses become the multipliers: normal ones first, then friction within what they allow.
void AugmentedSolve::take(ContactRows &rows, const ContactState &law, double h) {
  for (uint32_t i = 0; i < rows.n; ++i) {
    double *const l = &rows.impulse[size_t(i) * 3], *const a = &answer_[size_t(i) * 3];
    const double *const u = &speed_[size_t(i) * 3];
    normal_[i] = a[0];
    a[1] = a[2] = 0;
    if (a[0] > 0 && rows.wt[i] > 0) {
      const Tangential t = friction_impulse(law, i, h, pt_[i], {l[1], l[2]}, {u[1], u[2]}, a[0]);
      a[1] = t.a;
      a[2] = t.b;
    }
    store3(l, load3(a));
  }
}

// Updates converge linearly and, where contacts are nearly redundant, slowly: the next multipliers are the
// combination of the last few that Anderson's method makes of them.
void AugmentedSolve::extrapolate(ContactRows &rows) {
  double size = 0;
  for (uint32_t k = 0; k < 3 * rows.n; ++k) {
    const double weight = k % 3 == 0 ? pn_[k / 3] : pt_[k / 3];
    metric_[k] = weight;
    off_[k] = rows.impulse[k] - last_[k];
    size += weight * (off_[k] * off_[k]);
  }
  // contacts have opened or begun to slip: what was learned is void
  if (size > 4 * last_size_) updates_.start(3 * rows.n);
  last_size_ = size;
  updates_.next(last_.data(), off_.data(), metric_.data(), off_.data());
  for (uint32_t k = 0; k < 3 * rows.n; ++k) {
    const double l = last_[k] + off_[k];
    rows.impulse[k] = k % 3 == 0 ? std::max(0.0, l) : l;
  }
}

void AugmentedSolve::show(ContactRows &rows, const double *v) const {
  for (uint32_t d = 0; d < ndof_; ++d)
    if (place_[d] != kNone) store3(&rows.y[size_t(4) * d], load3(v + size_t(4) * place_[d]));
}

// Of dofs that answer it is J^T of the impulses that they have answered.
void AugmentedSolve::set_force(const ContactRows &rows, const MatrixPoints &points, const double *v) {
  points.multiply(v, force_.data());
  for (size_t k = 0; k < size_t(4) * n_; ++k) force_[k] -= points.load[k];
  std::fill(given_.begin(), given_.end(), 0.0);
  for (uint32_t i = 0; i < rows.n; ++i) rows.spread(i, load3(&rows.impulse[size_t(i) * 3]), given_.data());
  for (uint32_t d = 0; d < ndof_; ++d)
    if (place_[d] == kNone) fours(force_)[n_ + d] = fours(given_)[d];
}

double AugmentedSolve::error(const ContactRows &rows, const MatrixPoints &points, const double *v) {
  set_force(rows, points, v);
  answer_.assign(rows.impulse.begin(), rows.impulse.end());
  residual(rows, points);
  return precondition(rows, points);
}

AugmentedWork AugmentedSolve::run(ContactRows &rows, const ContactState &law, double h,
                                  const Tolerance &tolerance, double linear, uint32_t most_newton,
                                  const MatrixPoints &points, double *v) {
  AugmentedWork work;
  linear *= kKept;
  updates_.start(3 * rows.n);
  last_size_ = HUGE_VAL;
  set_force(rows, points, v);
  for (uint32_t i = 0; i < rows.n; ++i)
    normal_[i] = rows.impulse[size_t(i) * 3] > 0 ? rows.impulse[size_t(i) * 3] : h * law.fn[i];
  const auto follow = [&] {
    show(rows, v);
    for (uint32_t i = 0; i < rows.n; ++i) store3(&speed_[size_t(i) * 3], rows.velocity(i));
  };
  follow();
  for (;;) {
    answers(rows, law, h, true);
    residual(rows, points);
    factor(rows, points);
    work.linear = precondition(rows, points);
    double off = 0;  // m/s, of the multipliers
    for (uint32_t i = 0; i < rows.n; ++i) {
      const double *const l = &rows.impulse[size_t(i) * 3], *const a = &answer_[size_t(i) * 3];
      off = std::max({off, pn_[i] * std::fabs(a[0] - l[0]), pt_[i] * std::fabs(a[1] - l[1]),
                      pt_[i] * std::fabs(a[2] - l[2])});
    }
    if (work.linear <= std::max(linear, kInner * off)) {
      last_.assign(rows.impulse.begin(), rows.impulse.end());
      rows.impulse.assign(answer_.begin(), answer_.end());
      ++work.updates;
      const double left = weighted_residual(rows, weights(), law, h, tolerance).relative;
      rows.impulse.assign(last_.begin(), last_.end());
      work.converged = left <= 0.5 && work.linear <= linear;
      if (work.converged || work.newton == most_newton) break;
      take(rows, law, h);
      extrapolate(rows);
      answers(rows, law, h, true);
      residual(rows, points);
      factor(rows, points);
      work.linear = precondition(rows, points);
    }
    if (work.newton == most_newton) break;
    ++work.newton;
    work.iterations += gradients(rows, points, work.linear, std::max(0.5 * linear, kForcing * work.linear));
    const double t = search(rows, law, h);
    add(force_, t, ad_);
    for (size_t k = 0; k < size_t(4) * n_; ++k) v[k] += t * d_[k];
    for (uint32_t d = 0; d < ndof_; ++d)
      for (uint32_t c = 0; place_[d] == kNone && c < 3; ++c)
        rows.y[size_t(4) * d + c] += t * d_[size_t(4) * (n_ + d) + c];
    follow();
  }
  rows.impulse.assign(answer_.begin(), answer_.end());
  // What the residual leaves: of dofs that answer, all, so that their velocities are what their impulses
  // make; of free bodies, the momentum.
  for (uint32_t d = 0; d < ndof_; ++d)
    for (uint32_t c = 0; place_[d] == kNone && c < 3; ++c)
      rows.y[size_t(4) * d + c] += z_[size_t(4) * (n_ + d) + c];
  rigid_.give(points, r_.data(), v);
  show(rows, v);
  return work;
}

}  // namespace dfm
