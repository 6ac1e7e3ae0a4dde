// Where a body is: frame, displacements in it, modes and their rates, of the points alone.
#include <algorithm>
#include <cmath>

#include "../model_common/rotation.h"
#include "body.h"
#include "small.h"

namespace reduced {

// The frame at x + h v; v null: at x. Floating: the center of mass, and the rotation nearest to the body's by
// its masses, in which sum m X x u = 0. Held in all components: the same of the held points. Else it rests.
Frame Body::frame_of(const double *x, size_t stride, const double *v, double h) const {
  Frame f;
  if (!elastic_.floating && !elastic_.turns) return f;
  const size_t count = elastic_.floating ? elastic_.npoint : elastic_.holders.size();
  const auto place = [&](size_t n, double *out, double &mass) {
    const size_t i = elastic_.floating ? n : elastic_.holders[n];
    for (size_t a = 0; a < 3; ++a) out[a] = v ? x[i * stride + a] + h * v[i * stride + a] : x[i * stride + a];
    mass = elastic_.floating ? elastic_.mass[i] : 1;
    return elastic_.rest.data() + 3 * i;
  };
  double sum = 0, m, at[3], spread[9] = {};
  for (size_t n = 0; n < count; ++n) {
    place(n, at, m);
    for (size_t a = 0; a < 3; ++a) f.c[a] += m * at[a];
    sum += m;
  }
  for (double &a : f.c) a /= sum;
  for (size_t n = 0; n < count; ++n) {
    const double *const rest = place(n, at, m);
    for (size_t a = 0; a < 3; ++a)
      for (size_t b = 0; b < 3; ++b) spread[3 * a + b] += m * (at[a] - f.c[a]) * rest[b];
  }
  model::rotation::polar_of(spread, f.r);
  return f;
}

// Whether the pose of a body that is held in some components only has turned it against the axes they are of.
// A pose turns it as a whole; a body that was saved while it sagged is turned in the mean, and deformed as
// much.
bool Body::is_rotated(const dfm_kin &k) const {
  double c[3] = {}, rest[3] = {}, spread[9] = {}, r[9];
  for (size_t i = 0; i < elastic_.npoint; ++i)
    for (size_t a = 0; a < 3; ++a) {
      c[a] += elastic_.mass[i] * k.x[i * k.stride + a] / elastic_.total;
      rest[a] += elastic_.mass[i] * elastic_.rest[3 * i + a] / elastic_.total;
    }
  for (size_t i = 0; i < elastic_.npoint; ++i)
    for (size_t a = 0; a < 3; ++a)
      for (size_t b = 0; b < 3; ++b)
        spread[3 * a + b] +=
            elastic_.mass[i] * (k.x[i * k.stride + a] - c[a]) * (elastic_.rest[3 * i + b] - rest[b]);
  model::rotation::polar_of(spread, r);
  const double angle2 = 3 - ((r[0] + r[4]) + r[8]);  // of small angles their square
  double deformed = 0, moved = 0;
  for (size_t i = 0; i < elastic_.npoint; ++i) {
    double from[3], to[3];
    for (size_t a = 0; a < 3; ++a) from[a] = elastic_.rest[3 * i + a] - rest[a];
    product(r, from, to);
    for (size_t a = 0; a < 3; ++a) {
      const double left = (k.x[i * k.stride + a] - c[a]) - to[a];
      deformed += elastic_.mass[i] * left * left;
      moved += elastic_.mass[i] * (to[a] - from[a]) * (to[a] - from[a]);
    }
  }
  return angle2 > 0.01 || (angle2 > 1e-9 && deformed < 1e-6 * moved);
}

void Body::displacement(const dfm_kin &k, const Frame &f, double *u) const {
  for (size_t i = 0; i < elastic_.npoint; ++i) {
    double d[3];
    for (size_t a = 0; a < 3; ++a) d[a] = k.x[i * k.stride + a] - f.c[a];
    transposed_product(f.r, d, u + 3 * i);
    for (size_t a = 0; a < 3; ++a) u[3 * i + a] -= elastic_.rest[3 * i + a];
  }
}

// The displacement of the held components at x + h v, zero elsewhere. False: none to speak of.
bool Body::held_displacement(const dfm_kin &k, const Frame &f, double h, double *u) const {
  double most = 0;
  std::fill(u, u + size(), 0.0);
  for (const uint32_t i : elastic_.holders) {
    double d[3], turned[3];
    for (size_t a = 0; a < 3; ++a) {
      const size_t at = size_t(i) * k.stride + a;
      d[a] = k.x[at] + h * k.v[at] - f.c[a];
    }
    transposed_product(f.r, d, turned);
    for (size_t a = 0; a < 3; ++a) {
      if (!(elastic_.held[i] >> a & 1)) continue;
      u[3 * size_t(i) + a] = turned[a] - elastic_.rest[3 * size_t(i) + a];
      most = std::max(most, std::fabs(u[3 * size_t(i) + a]));
    }
  }
  return most > 1e-12 * elastic_.extent;
}

// The displacement at rest that the held points call for. The end of a step is the start of the next: what
// was found of the same held displacements is the same.
void Body::follow(const dfm_kin &k, const Frame &f, double h, int which, double *out) {
  double *const given = mu_.data();
  if (!held_displacement(k, f, h, given)) {
    std::fill(out, out + size(), 0.0);
    std::fill(given_[which].data(), given_[which].data() + size(), 0.0);
    return;
  }
  if (std::equal(given, given + size(), given_[which].data())) return;
  if (std::equal(given, given + size(), given_[1 - which].data())) {
    const Buffer<double> &other = which == 0 ? follow_to_ : follow_;
    std::copy(other.data(), other.data() + size(), out);
  } else {
    std::copy(given, given + size(), out);
    elastic_.follow(out);
  }
  std::copy(given, given + size(), given_[which].data());
}

// Is the force of every point its mass times the same a?
bool Body::uniform(const dfm_kin &k, const double *f, double *a) const {
  double most = 0;
  for (size_t n = 0; n < 3; ++n) {
    a[n] = f[n] / elastic_.mass[0];
    most = std::max(most, std::fabs(a[n]));
  }
  for (size_t i = 0; i < elastic_.npoint; ++i)
    for (size_t n = 0; n < 3; ++n)
      if (!(std::fabs(f[i * k.stride + n] - elastic_.mass[i] * a[n]) <= 1e-15 * elastic_.mass[i] * most))
        return false;
  return true;
}

void Body::where_floating(const dfm_kin &k, const double *f) {
  to_ = at_ = frame_of(k.x, k.stride, nullptr, 0);
  std::fill(velocity_, velocity_ + 3, 0.0);
  std::fill(moment_, moment_ + 3, 0.0);
  std::fill(force_sum_, force_sum_ + 3, 0.0);
  std::fill(torque_, torque_ + 3, 0.0);
  std::fill(inertia_, inertia_ + 9, 0.0);
  for (size_t i = 0; i < elastic_.npoint; ++i)
    for (size_t a = 0; a < 3; ++a) velocity_[a] += elastic_.mass[i] * k.v[i * k.stride + a];
  for (double &a : velocity_) a /= elastic_.total;
  displacement(k, at_, u_.data());
  for (size_t i = 0; i < elastic_.npoint; ++i) {
    const double m = elastic_.mass[i];
    double r[3], d[3], b[3];
    for (size_t a = 0; a < 3; ++a) {
      r[a] = elastic_.rest[3 * i + a] + u_[3 * i + a];
      d[a] = k.v[i * k.stride + a] - velocity_[a];
      b[a] = k.x[i * k.stride + a] - at_.c[a];
      force_sum_[a] += f[i * k.stride + a];
    }
    cross_add(b, d, m, moment_);
    cross_add(b, f + i * k.stride, 1, torque_);
    transposed_product(at_.r, d, w_.data() + 3 * i);
    inertia_add(r, m, inertia_);
  }
  mirror_upper(inertia_);
}

void Body::where_held(const dfm_kin &k) {
  at_ = frame_of(k.x, k.stride, nullptr, 0);
  moving_ = false;
  for (const uint32_t i : elastic_.holders)
    for (size_t a = 0; a < 3; ++a)
      moving_ = moving_ || (elastic_.held[i] >> a & 1 && k.v[size_t(i) * k.stride + a] != 0);
  to_ = moving_ ? frame_of(k.x, k.stride, k.v, h_) : at_;
  follow(k, at_, 0, 0, follow_.data());
  if (moving_) follow(k, to_, h_, 1, follow_to_.data());
  led_ = std::any_of(follow_.data(), follow_.data() + size(), [](double a) { return a != 0; });
  displacement(k, at_, u_.data());
  for (size_t i = 0; i < elastic_.npoint; ++i) {
    double d[3], before[3], after[3], turned[3];
    for (size_t a = 0; a < 3; ++a) {
      u_[3 * i + a] -= follow_[3 * i + a];
      d[a] = k.v[i * k.stride + a];
    }
    if (moving_) {
      for (size_t a = 0; a < 3; ++a) before[a] = elastic_.rest[3 * i + a] + follow_[3 * i + a];
      product(at_.r, before, turned);
      for (size_t a = 0; a < 3; ++a) {
        before[a] = elastic_.rest[3 * i + a] + follow_to_[3 * i + a];
        d[a] += (turned[a] + at_.c[a]) / h_;
      }
      product(to_.r, before, after);
      for (size_t a = 0; a < 3; ++a) d[a] -= (after[a] + to_.c[a]) / h_;
    }
    transposed_product(at_.r, d, w_.data() + 3 * i);
    for (size_t a = 0; a < 3; ++a)
      if (elastic_.held[i] >> a & 1) u_[3 * i + a] = w_[3 * i + a] = 0;
  }
}

// Modes and their rates, and the forces along them.
void Body::project(const dfm_kin &k, const double *f) {
  for (size_t j = 0; j < size(); ++j) {
    mu_[j] = elastic_.mass[j / 3] * u_[j];
    mw_[j] = elastic_.mass[j / 3] * w_[j];
  }
  double a[3];
  even_ = uniform(k, f, a);
  if (!even_)
    for (size_t i = 0; i < elastic_.npoint; ++i)
      transposed_product(at_.r, f + i * k.stride, f_.data() + 3 * i);
  const double *const in[] = {mu_.data(), mw_.data(), f_.data()};
  double *const out[] = {q_.data(), qd_.data(), load_.data()};
  modes_.shape.project(even_ ? 2 : 3, in, out);
  if (!even_) return;
  transposed_product(at_.r, a, pull_of_);
  for (uint32_t n = 0; n < modes_.count; ++n) {
    const double *const p = pull_.data() + 3 * size_t(n);
    load_[n] = elastic_.floating ? 0 : (p[0] * pull_of_[0] + p[1] * pull_of_[1]) + p[2] * pull_of_[2];
  }
}

// The part of the displacements s beside the modes in C = sum m r x W, into coupling_: by rows a,
// sum m (s x W)_a = sum m (e_a x s) . W.
void Body::couple_rest() {
  double *const turned[] = {mu_.data(), u_to_.data(), w_to_.data()};  // free until the modes have advanced
  for (size_t i = 0; i < elastic_.npoint; ++i)
    for (size_t a = 0; a < 3; ++a) {
      const size_t b = (a + 1) % 3, c = (a + 2) % 3;
      double *const at = turned[a] + 3 * i;
      at[a] = 0;
      at[b] = -elastic_.mass[i] * rest_[3 * i + c];
      at[c] = elastic_.mass[i] * rest_[3 * i + b];
    }
  double *const c = coupling_.data();
  double *const rows[] = {c, c + modes_.count, c + 2 * size_t(modes_.count)};
  modes_.shape.project(3, turned, rows);
}

// The velocity beside the center's is w_i = s x r_i + sum W_ik q'_k, found as the nearest by mass. With
// C = sum m r x W, not zero where the body is deformed:  I s + C q' = L,  C^T s + q' = W^T M w.
// C has to be that of all displacements: what it leaves out of C^T s is taken for rates of the modes, and
// what it leaves out of C q' for spin, again in each step, however short: energy without bound.
void Body::find_spin() {
  const uint32_t count = modes_.count;
  double left[9], right[3], inverted[9];
  const double *row[3];
  transposed_product(at_.r, moment_, right);
  std::copy(inertia_, inertia_ + 9, left);
  if (beside_) couple_rest();
  else std::fill(coupling_.data(), coupling_.data() + 3 * size_t(count), 0.0);
  for (size_t a = 0; a < 3; ++a) {
    double *const c = coupling_.data() + a * count;
    for (size_t k = 0; k < count; ++k)
      for (size_t l = 0; l < count; ++l) c[l] += q_[k] * twist_[(a * count + k) * count + l];
    for (size_t l = 0; l < count; ++l) right[a] -= c[l] * qd_[l];
    row[a] = c;
  }
  for (size_t a = 0; a < 3; ++a)
    for (size_t b = 0; b < 3; ++b)
      for (size_t l = 0; l < count; ++l) left[3 * a + b] -= row[a][l] * row[b][l];
  invert(left, inverted);
  product(inverted, right, spin_);
  for (size_t l = 0; l < count; ++l)
    qd_[l] -= (row[0][l] * spin_[0] + row[1][l] * spin_[1]) + row[2][l] * spin_[2];
}

// Keeps the displacements that are no sum of modes, if there are any: in a condensed body, after other models
// have deformed the body, or after contact has turned it.
void Body::keep_rest() {
  double all = 0, held = 0;
  for (size_t j = 0; j < size(); ++j) all += mu_[j] * u_[j];
  for (uint32_t k = 0; k < modes_.count; ++k) held += q_[k] * q_[k];
  const double small = 1e-12 * elastic_.extent;
  beside_ = all - held > 1e-12 * all + elastic_.total * small * small;
  has_rest_ = condensed_ || beside_;
  if (!has_rest_) return;
  const double *const in[] = {q_.data()};
  double *const out[] = {rest_.data()};
  modes_.shape.expand(1, in, out);
  for (size_t j = 0; j < size(); ++j) rest_[j] = u_[j] - rest_[j];
}

// Condensed, held: of a uniform acceleration along each axis.
void Body::find_weight_at_rest() {
  weight_at_rest_.create(host, 3 * size());
  for (size_t a = 0; a < 3; ++a) {
    std::fill(f_.data(), f_.data() + size(), 0.0);
    for (size_t i = 0; i < elastic_.npoint; ++i) f_[3 * i + a] = elastic_.mass[i];
    for (size_t k = 0; k < modes_.count; ++k) load_[k] = pull_[3 * k + a];
    rest_under(f_.data(), load_.data(), weight_at_rest_.data() + a * size());
    for (size_t j = 0; j < size(); ++j)
      weight_of_weight_[3 * (j % 3) + a] += elastic_.mass[j / 3] * weight_at_rest_[a * size() + j];
  }
}

// out = C f less what the modes have of it; load = W^T f
void Body::rest_under(const double *f, const double *load, double *out) {
  elastic_.compliance(f, out);
  for (uint32_t k = 0; k < modes_.count; ++k) modal_[k] = load[k] / modes_.lambda[k];
  const double *const in[] = {modal_.data()};
  double *const held[] = {mw_.data()};
  modes_.shape.expand(1, in, held);
  for (size_t j = 0; j < size(); ++j) out[j] -= mw_[j];
}

// Condensed: where the forces have what the modes leave out at rest; null: nowhere. A force that is the same
// as before has it at the same place.
const double *Body::rest_of_forces() {
  if (even_ && elastic_.floating) return nullptr;
  if (even_) {
    for (size_t j = 0; j < size(); ++j)
      mw_[j] = (pull_of_[0] * weight_at_rest_[j] + pull_of_[1] * weight_at_rest_[size() + j]) +
               pull_of_[2] * weight_at_rest_[2 * size() + j];
    return mw_.data();
  }
  if (!std::equal(f_.data(), f_.data() + size(), under_of_.data())) {
    rest_under(f_.data(), load_.data(), under_.data());
    std::copy(f_.data(), f_.data() + size(), under_of_.data());
  }
  return under_.data();
}

}  // namespace reduced
