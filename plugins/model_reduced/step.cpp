// From where a body is to where its step leads: without contact, and what impulses change of that.
#include <algorithm>
#include <cmath>

#include "../model_common/entry.h"
#include "body.h"
#include "small.h"

namespace reduced {
namespace {

constexpr double kPi = 0x1.921fb54442d18p+1;
constexpr int kMidpointPasses = 8;

}  // namespace

// A mode above the step's Nyquist frequency has no more than one sample in half a period: its oscillation
// would be that of another frequency. Backward Euler leaves the oscillation out and keeps its share of the
// static response. So it does for all modes while the body is touched.
void Body::set_steps() {
  if (step_h_ == h_ && step_soft_ == soft_) return;
  step_h_ = h_;
  step_soft_ = soft_;
  const double drag = params_[kDampingMass];
  rigid_ = damped_step(0, drag, h_).vv;
  // faster than the fastest mode: those that are left out have shorter periods
  left_ = dfm_exp(-h_ * std::sqrt(modes_.lambda[modes_.count - 1]));
  drift_ = soft_ ? damped_step(0, drag, h_) : exact_step(0, drag, h_);
  for (uint32_t k = 0; k < modes_.count; ++k) {
    const double l = modes_.lambda[k], d = drag + params_[kDampingStiffness] * l;
    softened_[k] = damped_step(l, d, h_).vv;
    step_[k] = soft_ || l * h_ * h_ > kPi * kPi ? damped_step(l, d, h_) : exact_step(l, d, h_);
  }
  name_aliases();
}

void Body::name_aliases() {
  if (named_) return;
  uint32_t first = 0;
  while (first < modes_.count && modes_.lambda[first] * h_ * h_ <= kPi * kPi) ++first;
  if (first == modes_.count) return;
  named_ = true;
  model::say(
      host, 2, id_,
      "%u of %u modes, from %.4g Hz on, lie above the Nyquist frequency %.4g Hz of the step %g s: their "
      "oscillation is dropped, their share of the response at rest is kept",
      modes_.count - first, modes_.count, std::sqrt(modes_.lambda[first]) / (2 * kPi), 0.5 / h_, h_);
}

dfm_status Body::predict(const dfm_kin &k, const double *f, double *u_s) {
  if (!checked_ && !elastic_.floating && !elastic_.turns && is_rotated(k)) {
    model::complain(host, id_,
                    "held components are along the axes of the world, but the pose has turned the body; turn "
                    "the mesh instead, or hold whole points");
    return DFM_E_UNSUPPORTED;
  }
  checked_ = true;
  h_ = k.dt;
  soft_ = k.state[kTouched] != 0;
  set_steps();
  const Lead lead = elastic_.floating ? Lead::points : Lead(int(k.state[kLead]));
  near_only_ = lead == Lead::state && stays_near(k, f);
  if (near_only_) return predict_near(k, u_s);
  if (lead != Lead::state) return predict_all(k, f, u_s);
  dfm_kin all;
  all_points(k, all);
  return predict_all(all, f, u_s);
}

dfm_status Body::predict_all(const dfm_kin &k, const double *f, double *u_s) {
  if (elastic_.floating) where_floating(k, f);
  else where_held(k);
  project(k, f);
  keep_rest();
  rest_is_known_ = !elastic_.floating && k.state[kLead] != double(Lead::points) && even_ && !moving_ &&
                   !led_ && holds_rest(k.state);
  if (elastic_.floating) {
    find_spin();
    advance_frame();
  }
  advance_modes();
  if (elastic_.floating) place_floating();
  else place_held(k);
  double nan_flag = 0;  // a body crushed to a point has no frame, and no inverse of its inertia
  for (uint32_t s = 0; s < nsurfel_; ++s)
    for (size_t a = 0; a < 3; ++a) {
      double way = 0;
      for (uint32_t e = row_[s]; e < row_[s + 1]; ++e) {
        const size_t i = col_[e];
        way += weight_[e] * (x_to_[3 * i + a] - k.x[i * k.stride + a]);
      }
      u_s[3 * size_t(s) + a] = way / h_;
      nan_flag += 0 * way;
    }
  return nan_flag == 0 ? DFM_OK : DFM_DISCARD;
}

// The rigid motion: the center of mass by the same transition as a mode without stiffness, the rotation
// with the angular velocity of the middle of the step, from the angular momentum there by the implicit
// midpoint rule on the group of rotations. The rule is its own inverse under h -> -h: its error of the
// energy of a free body comes and goes and does not add up. The first pass alone, with the spin of the
// start, is the explicit rule, and takes a stiff body from one axis to another. A pass has the error times
// about h |spin| / 2; as the rotation is a rotation in every pass, the spin is that of the angular momentum
// whether passes meet or not.
void Body::advance_frame() {
  double middle[3], half[9], left[9], inverted[9], l[3], local[3], spin[3], world[3], swung[3] = {};
  for (size_t a = 0; a < 3; ++a) {
    const double f = force_sum_[a] / elastic_.total;
    to_.c[a] = at_.c[a] + (drift_.qv * velocity_[a] + drift_.qf * f);
    velocity_to_[a] = drift_.vv * velocity_[a] + drift_.vf * f;
    moment_to_[a] = drift_.vv * moment_[a] + drift_.vf * torque_[a];
    middle[a] = soft_ ? moment_to_[a] : 0.5 * (moment_[a] + moment_to_[a]);
  }
  for (size_t a = 0; a < 3; ++a)
    for (size_t n = 0; n < modes_.count; ++n) swung[a] += coupling_[a * modes_.count + n] * qd_[n];
  invert(inertia_, inverted);
  product(at_.r, spin_, spin);
  for (int pass = 0; pass < kMidpointPasses; ++pass) {
    for (size_t a = 0; a < 3; ++a) world[a] = 0.5 * h_ * spin[a];
    turned(world, at_.r, half);
    transposed_product(half, middle, l);
    for (size_t a = 0; a < 3; ++a) l[a] -= swung[a];
    product(inverted, l, local);
    product(half, local, spin);
  }
  for (double &a : spin) a *= h_;
  turned(spin, at_.r, to_.r);
  matrix_product(at_.r, inverted, left);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      turning_[3 * i + j] = (left[3 * i] * at_.r[3 * j] + left[3 * i + 1] * at_.r[3 * j + 1]) +
                            left[3 * i + 2] * at_.r[3 * j + 2];
}

// The centrifugal force on a mode is that of the body's rest shape; Coriolis's is left out. It falls where
// the mode moves outwards, since the angular momentum is kept: by k per q near some q. Constant over the
// step, as the loads are, it would be a spring that answers late, and the map of (q, q') would have the
// determinant 1 + k (1 - cos(w h)) / w^2: energy without bound. As a kick before the free motion it has
// determinant 1, whatever the force is as long as it follows from q. In a damped step both are the same.
void Body::advance_coordinates() {
  double square = 0;
  for (const double a : spin_) square += a * a;
  for (uint32_t k = 0; k < modes_.count; ++k) {
    double f = load_[k], kick = 0;
    if (square > 0) {
      const double *const s = swing_.data() + 9 * size_t(k);
      double along = 0;
      for (size_t a = 0; a < 3; ++a)
        for (size_t b = 0; b < 3; ++b) along += spin_[a] * s[3 * a + b] * spin_[b];
      kick = h_ * (square * ((s[0] + s[4]) + s[8]) - along);
    }
    const Transition &t = step_[k];
    q_to_[k] = (t.qq * q_[k] + t.qv * (qd_[k] + kick)) + t.qf * f;
    qd_to_[k] = (t.vq * q_[k] + t.vv * (qd_[k] + kick)) + t.vf * f;
  }
}

// Displacements that are no sum of modes move to their static solution under the forces; in a modal body, to
// zero.
void Body::advance_modes() {
  advance_coordinates();
  const double *const in[] = {q_to_.data(), qd_to_.data()};
  double *const out[] = {u_to_.data(), w_to_.data()};
  modes_.shape.expand(2, in, out);
  for (size_t j = 0; has_rest_ && j < size(); ++j) u_to_[j] += left_ * rest_[j];
  const double *const led = condensed_ ? rest_of_forces() : nullptr;
  for (size_t j = 0; led && j < size(); ++j) u_to_[j] += (1 - left_) * led[j];
}

void Body::place_floating() {
  const double *const rest = elastic_.rest.data();
  for (size_t i = 0; i < elastic_.npoint; ++i) {
    double r[3], v[3];
    for (size_t a = 0; a < 3; ++a) r[a] = rest[3 * i + a] + u_to_[3 * i + a];
    product(to_.r, r, x_to_.data() + 3 * i);
    product(to_.r, w_to_.data() + 3 * i, v);
    for (size_t a = 0; a < 3; ++a) {
      x_to_[3 * i + a] += to_.c[a];
      v_to_[3 * i + a] = velocity_to_[a] + v[a];
    }
  }
  match_moment(moment_to_, to_.c, velocity_to_, x_to_.data(), v_to_.data(), 3);
}

// Adds the rotation that gives the points this angular momentum about their center of mass, c.
void Body::match_moment(const double *wanted, const double *c, const double *velocity, const double *x,
                        double *v, size_t stride) const {
  double inertia[9] = {}, moment[3] = {}, inverted[9], spin[3];
  for (size_t i = 0; i < elastic_.npoint; ++i) {
    const double m = elastic_.mass[i];
    double r[3], d[3];
    for (size_t a = 0; a < 3; ++a) {
      r[a] = x[i * stride + a] - c[a];
      d[a] = v[i * stride + a] - velocity[a];
    }
    cross_add(r, d, m, moment);
    inertia_add(r, m, inertia);
  }
  mirror_upper(inertia);
  for (size_t a = 0; a < 3; ++a) moment[a] = wanted[a] - moment[a];
  invert(inertia, inverted);
  product(inverted, moment, spin);
  for (size_t i = 0; i < elastic_.npoint; ++i) {
    double r[3];
    for (size_t a = 0; a < 3; ++a) r[a] = x[i * stride + a] - c[a];
    cross_add(spin, r, 1, v + i * stride);
  }
}

void Body::place_held(const dfm_kin &k) {
  const Buffer<double> &led = moving_ ? follow_to_ : follow_;
  for (size_t i = 0; i < elastic_.npoint; ++i) {
    double r[3], before[3], turned[3];
    double *const x = x_to_.data() + 3 * i, *const v = v_to_.data() + 3 * i;
    for (size_t a = 0; a < 3; ++a) {
      before[a] = elastic_.rest[3 * i + a] + led[3 * i + a];
      r[a] = before[a] + u_to_[3 * i + a];
    }
    product(to_.r, r, x);
    product(to_.r, w_to_.data() + 3 * i, v);
    for (size_t a = 0; a < 3; ++a) x[a] += to_.c[a];
    if (moving_) {
      product(to_.r, before, turned);
      for (size_t a = 0; a < 3; ++a) v[a] += (turned[a] + to_.c[a]) / h_;
      for (size_t a = 0; a < 3; ++a) before[a] = elastic_.rest[3 * i + a] + follow_[3 * i + a];
      product(at_.r, before, turned);
      for (size_t a = 0; a < 3; ++a) v[a] -= (turned[a] + at_.c[a]) / h_;
    }
    for (size_t a = 0; a < 3; ++a) {
      if (!(elastic_.held[i] >> a & 1)) continue;
      v[a] = k.v[i * k.stride + a];
      x[a] = k.x[i * k.stride + a] + h_ * v[a];
    }
  }
}

void Body::commit(const dfm_kin &k, const double *p_s, double *x, double *v) {
  if (near_only_) {
    commit_near(k, p_s, x, v);
    dfm_kin end = k;
    end.x = x;
    end.state = k.state_out;
    points(end, x, v);
    if (k.state_out) look(k.state_out);
    return;
  }
  end_state(k, p_s, commit_all(k, p_s, x, v), Lead::points);
}

bool Body::commit_all(const dfm_kin &k, const double *p_s, double *x, double *v) {
  const bool touched = std::any_of(p_s, p_s + 3 * size_t(nsurfel_), [](double p) { return p != 0; });
  double sum[3] = {}, moment[3] = {}, turn[3] = {};
  if (touched) {
    if (condensed_) std::fill(rest_.data(), rest_.data() + size(), 0.0);
    if (condensed_) add_displacement_at_rest(p_s, rest_.data());
    take_impulses(k, p_s, sum, moment);
    const double *const in[] = {modal_.data()};
    double *const out[] = {w_.data()};
    modes_.shape.expand(1, in, out);
    if (elastic_.floating) product(turning_, moment, turn);
    for (double &a : sum) a *= rigid_ / elastic_.total;
  }
  for (size_t i = 0; i < elastic_.npoint; ++i) {
    double change[3] = {}, at_rest[3] = {}, r[3];
    double *const xi = x + i * k.stride, *const vi = v + i * k.stride;
    if (touched) {
      product(at_.r, w_.data() + 3 * i, change);
      if (condensed_) product(at_.r, rest_.data() + 3 * i, at_rest);
      if (elastic_.floating) {
        for (size_t a = 0; a < 3; ++a) {
          r[a] = k.x[i * k.stride + a] - at_.c[a];
          change[a] += sum[a];
        }
        cross_add(turn, r, rigid_, change);
      }
    }
    for (size_t a = 0; a < 3; ++a) {
      xi[a] = touched ? x_to_[3 * i + a] + h_ * (change[a] + at_rest[a]) : x_to_[3 * i + a];
      vi[a] = touched ? v_to_[3 * i + a] + change[a] : v_to_[3 * i + a];
    }
    for (size_t a = 3; a < k.stride; ++a) xi[a] = vi[a] = 0;
  }
  if (touched && elastic_.floating) {
    double wanted[3], c[3], velocity[3];
    for (size_t a = 0; a < 3; ++a) {
      wanted[a] = moment_to_[a] + rigid_ * moment[a];
      c[a] = to_.c[a] + h_ * sum[a];
      velocity[a] = velocity_to_[a] + sum[a];
    }
    match_moment(wanted, c, velocity, x, v, k.stride);
  }
  look_at_gradient(k.t, x, k.stride);
  return touched;
}

// The displacement gradient is at most the sum of the modes' own: a look at the cells only where that is
// large. It is reported when it leaves the range, again when it has doubled since, and again once
// it has been back for a while: an oscillating body reports it once and not in each period.
void Body::look_at_gradient(double time, const double *x, size_t stride) {
  double bound = 0;
  for (uint32_t k = 0; k < modes_.count; ++k) bound += std::fabs(q_to_[k]) * gradient_[k];
  if (reported_ > 0 && time - outside_ > kForgotten) reported_ = 0;
  if (!(bound > kLargestGradient || led_ || has_rest_ || condensed_) || since_look_++ % 16 != 0) return;
  dfm_kin k{};
  k.stride = uint32_t(stride);
  k.x = x;
  Frame f;
  whole_displacement(k, f);
  uint32_t cell = 0;
  const double most = elastic_.largest_gradient(u_.data(), &cell);
  warn_gradient(time, most, "in cell", cell);
}

void Body::warn_gradient(double time, double most, const char *where, uint32_t which) {
  if (!(most > kLargestGradient)) return;
  outside_ = time;
  if (!(most > 2 * reported_)) return;
  reported_ = most;
  model::say(host, 2, id_,
             "the displacement gradient reaches %.2g %s %u: above %g the strains of this model are wrong; "
             "corotational_fem has no such limit",
             most, where, which, kLargestGradient);
}

}  // namespace reduced
