// The step. Every cluster's rest shape is fitted to its points once, at the start: goals, and the axes about
// which it turns, then stay as they are, and what an impulse changes is one symmetric matrix for the whole
// step. With P the mean over a point's clusters of the rigid velocity that has the cluster's momentum and
// angular momentum, a change dv of the points' velocities becomes
//   du = given dv + (1 - given) P dv,   0 < given <= 1.
#include <deform/elementary.h>

#include <algorithm>
#include <cmath>

#include "shape_fit.h"

namespace shape {

namespace {

using model::cross;
using model::matrix_product;
using model::product;
using model::transposed_matrix_product;

constexpr double kPi = 3.14159265358979323846;
// det A below which goals leave the fit for the rigid ones: a cluster that is flat or turned inside out has
// no fit worth following.
constexpr double kCrushed = 0.1;
// Moments of inertia that turn anything, over the largest; and that of a cluster which is no mere point, over
// mass times size squared: its arms are above rounding.
constexpr double kTurned = 1e-13, kPoint = 1e-11;

// Of (w h)^2 where clusters share a deviation: the largest stable value (doc/models/shape_matching.md).
constexpr double kMaxLed = 4;

double determinant(const double *a) {
  return (a[0] * (a[4] * a[8] - a[5] * a[7]) + a[1] * (a[5] * a[6] - a[3] * a[8])) +
         a[2] * (a[3] * a[7] - a[4] * a[6]);
}

// A root of x (x - s) = m without cancellation: the greater one, or where `smaller` (s > 0 > m) the other.
double side_of(double s, double m, bool smaller) {
  const double root = std::sqrt(std::max(0.0, s * s + 4 * m));
  if (smaller) return -2 * m / (root + s);
  return s >= 0 ? 0.5 * (root + s) : 2 * m / (root - s);
}

// The three numbers next to s whose product is `volume`, by the multiplier m of that condition: each is a
// root of x (x - s) = m. The product rises with m; where it is too large at the least m, the smallest number
// takes its smaller root, with which the product falls to 0.
void sides_of_volume(const double *s, double volume, double *x) {
  int small = 0;
  double least = HUGE_VAL, most = 0;
  for (int i = 0; i < 3; ++i) {
    most = std::max(most, std::fabs(s[i]));
    if (std::fabs(s[i]) < least) {
      least = std::fabs(s[i]);
      small = i;
    }
  }
  const double side = dfm_pow(volume, 1.0 / 3), end = -0.25 * least * least;
  double sign = 1, lo = end, hi = side * (side + most);
  const auto product = [&](double m) {
    for (int i = 0; i < 3; ++i) x[i] = side_of(s[i], m, i == small && sign < 0);
    return (x[0] * x[1]) * x[2];
  };
  if (product(lo) > volume) {
    sign = -1;
    hi = 0;
  }
  // Newton's method within bounds: at the left end the product is as steep as a root
  double m = sign > 0 ? std::max(lo, std::min(0.0, hi)) : 0.5 * (lo + hi);
  for (int k = 0; k < 100; ++k) {
    const double p = product(m);
    (sign * (p - volume) > 0 ? hi : lo) = m;
    double slope = 0;  // of the logarithm: dx = dm / (2 x - s)
    for (int i = 0; i < 3; ++i) slope += 1 / (x[i] * (2 * x[i] - s[i]));
    const double next = p > 0 && std::isfinite(slope) && slope != 0 ? m - (p - volume) / (p * slope) : lo;
    const double to = next > lo && next < hi ? next : 0.5 * (lo + hi);
    if (std::fabs(to - m) <= 1e-15 * side * side) return;
    m = to;
  }
}

// The map of the points' places at rest that keeps their volume and takes them nearest to where the fit has
// them, with masses as weights. Half of the distance squared is an energy, and the pull to this goal its
// gradient. A fit that is only scaled to the volume pulls along no gradient: a body that is squeezed gains
// energy from it.
void nearest_of_volume(const double *moments, const Cluster &c, double *out) {
  double b[9], turn[9], s[3][3], v[3][3], strain[9];
  matrix_product(moments, c.root_inverse, b);
  model::rotation::polar_of(b, turn);
  transposed_matrix_product(turn, b, strain);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) s[i][j] = 0.5 * (strain[3 * i + j] + strain[3 * j + i]);
  model::jacobi(s, v);
  const double sides[3] = {s[0][0], s[1][1], s[2][2]};
  double x[3], kept[9];
  sides_of_volume(sides, c.content, x);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      strain[3 * i + j] = (v[i][0] * x[0] * v[j][0] + v[i][1] * x[1] * v[j][1]) + v[i][2] * x[2] * v[j][2];
  matrix_product(turn, strain, kept);
  matrix_product(kept, c.root_inverse, out);
}

// Vector from the center, whose rounding error is subtracted: a cluster that has collapsed to one point must
// not take rounding for its shape.
void arm_of(const Frame &f, const double *x, double *out) {
  for (int a = 0; a < 3; ++a) out[a] = (x[a] - f.center[a]) - f.remainder[a];
}

}  // namespace

// The deviation d of a point oscillates with w^2 = (ln(1 - a0)/h0)^2 and the damping ratio zeta. Its mean
// velocity over a step, w' = kept w + given h f/m - pulled d, has the roots
// e^(-(zeta -+ i sqrt(1 - zeta^2)) w h) of the continuous motion, and rests at d = f/(m w^2), whatever h is.
Rates Body::rates_of(double h) const {
  const double omega = -dfm_log(1 - params[kStiffness]) / params[kReferenceStep], zeta = params[kDamping];
  const double y = omega * h, decay = dfm_exp(-zeta * y), lost = 1 - decay;
  const double half = dfm_sinpi(y * std::sqrt(1 - zeta * zeta) / (2 * kPi));
  const double square = lost * lost + 4 * decay * (half * half);  // |1 - root|^2
  const double led = std::min(y * y, kMaxLed) - square;
  return {decay * decay, std::min(square / (y * y), 1.0), square / h, led / h,
          dfm_exp(-params[kDampingMass] * h)};
}

// Clusters that move against each other are as stiff as requested while (w h)^2 is at most kMaxLed.
void Body::warn_softened(double h) {
  const double longest = std::sqrt(kMaxLed) * params[kReferenceStep] / -dfm_log(1 - params[kStiffness]);
  if (warned_softened || ncluster == 1 || h <= longest) return;
  warned_softened = true;
  model::say(
      host, 2, kId,
      "at the step %g s clusters move against each other more softly than asked; up to %.3g s they are "
      "as stiff as asked",
      h, longest);
}

void Body::fit(uint32_t c, const dfm_kin &k) {
  Frame &f = frame[c];
  const uint32_t begin = cluster_begin[c], n = cluster_begin[c + 1] - begin;
  const int width = width_of(mode());
  const double *const plastic = k.state + kPlastic * size_t(c);
  f.flowed = false;
  for (int e = 0; e < kPlastic; ++e) {
    f.plastic[e] = plastic[e];
    f.flowed |= plastic[e] != (e % 4 == 0);
  }
  const auto from = [&](uint32_t m, double *out) {
    const double *const at = q.data() + 3 * size_t(begin + m);
    if (f.flowed) return product(f.plastic, at, out);
    std::copy(at, at + 3, out);
  };
  f.now = cluster[c];
  double own[3], b[kBasis];
  const auto at = [&](uint32_t m) {
    from(m, own);
    return static_cast<const double *>(own);
  };
  if (f.flowed) measure(at, part.data() + begin, n, mode(), f.now);
  const auto mean = [&](const double *from_here, double *out) {
    for (size_t a = 0; a < 3; ++a) {
      double sum = 0;
      for (uint32_t m = begin; m < begin + n; ++m)
        sum += part[m] * (position[3 * size_t(cluster_point[m]) + a] - from_here[a]);
      out[a] = sum / f.now.mass;
    }
  };
  const double origin[3] = {};
  mean(origin, f.center);
  mean(f.center, f.remainder);
  double full[3 * kBasis] = {}, linear[9], inertia[9] = {}, turn[9], stretched[9];
  for (uint32_t m = 0; m < n; ++m) {
    const double *const x = position.data() + 3 * size_t(cluster_point[begin + m]);
    const double mass = part[begin + m];
    double p[3];
    arm_of(f, x, p);
    basis_of(f.now, mode(), at(m), b);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < width; ++j) full[kBasis * i + j] += mass * (p[i] * b[j]);
      for (int j = 0; j < 3; ++j) {
        inertia[3 * i + j] -= mass * (p[i] * p[j]);
        inertia[4 * j] += mass * (p[i] * p[i]);
      }
    }
  }
  for (int i = 0; i < 9; ++i) linear[i] = full[kBasis * (i / 3) + i % 3];
  inverse_of<3>(inertia, kTurned, f.inverse_inertia, kPoint * f.now.mass * (f.now.size * f.now.size));
  model::rotation::polar_of(linear, turn);
  matrix_product(linear, f.now.linear_inverse, stretched);
  f.volume = determinant(stretched);
  transposed_matrix_product(turn, stretched, f.stretch);
  find_goal(turn, linear, full, f);
}

// goal = share of the fit + (1 - share) R. The linear fit keeps its volume.
void Body::find_goal(const double *turn, const double *moments, const double *full, Frame &f) const {
  std::fill(f.goal, f.goal + 3 * kBasis, 0.0);
  double share = mode() == kRigid ? 0 : params[kLinearity], kept[9] = {};
  if (mode() == kLinear && f.now.content > 0) nearest_of_volume(moments, f.now, kept);
  else if (mode() == kLinear) share = 0;
  else share *= std::min(1.0, std::max(0.0, f.volume / kCrushed));
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      f.goal[kBasis * i + j] = (1 - share) * turn[3 * i + j] + share * kept[3 * i + j];
  if (mode() != kQuadratic) return;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < kBasis; ++j) {
      double sum = 0;
      for (int m = 0; m < kBasis; ++m) sum += full[kBasis * i + m] * f.now.basis_inverse[kBasis * m + j];
      f.goal[kBasis * i + j] += share * sum;
    }
}

// m: the mean of the goals less the position.
void Body::to_goal(uint32_t point, double *d) const {
  const uint32_t begin = point_begin[point], end = point_begin[point + 1];
  const int width = width_of(mode());
  double b[kBasis], flowed[3];
  for (int a = 0; a < 3; ++a) d[a] = 0;
  for (uint32_t m = begin; m < end; ++m) {
    const Frame &f = frame[point_cluster[m]];
    const double *at = q.data() + 3 * size_t(point_place[m]);
    if (f.flowed) {
      product(f.plastic, at, flowed);
      at = flowed;
    }
    basis_of(f.now, mode(), at, b);
    double arm[3];
    arm_of(f, position.data() + 3 * size_t(point), arm);
    for (int i = 0; i < 3; ++i) {
      double sum = -arm[i];
      for (int j = 0; j < width; ++j) sum += f.goal[kBasis * i + j] * b[j];
      d[i] += sum / (end - begin);
    }
  }
}

void Body::add_momentum(uint32_t point, const double *w) {
  const double *const x = position.data() + 3 * size_t(point);
  for (uint32_t m = point_begin[point]; m < point_begin[point + 1]; ++m) {
    const uint32_t c = point_cluster[m];
    const double mass = part[point_place[m]];
    double arm[3], turning[3], *const sum = momentum.data() + 6 * size_t(c);
    arm_of(frame[c], x, arm);
    cross(arm, w, turning);
    for (int a = 0; a < 3; ++a) {
      sum[a] += mass * w[a];
      sum[3 + a] += mass * turning[a];
    }
  }
}

void Body::make_rigid(uint32_t c) {
  double *const v = momentum.data() + 6 * size_t(c), spin[3];
  for (int a = 0; a < 3; ++a) v[a] /= cluster[c].mass;
  product(frame[c].inverse_inertia, v + 3, spin);
  std::copy(spin, spin + 3, v + 3);
}

void Body::rigid_velocity(uint32_t point, double *out) const {
  const uint32_t begin = point_begin[point], end = point_begin[point + 1];
  const double *const x = position.data() + 3 * size_t(point);
  for (int a = 0; a < 3; ++a) out[a] = 0;
  for (uint32_t m = begin; m < end; ++m) {
    const uint32_t c = point_cluster[m];
    const double *const v = momentum.data() + 6 * size_t(c);
    double arm[3], turning[3];
    arm_of(frame[c], x, arm);
    cross(v + 3, arm, turning);
    for (int a = 0; a < 3; ++a) out[a] += (v[a] + turning[a]) / (end - begin);
  }
}

void Body::predict(const dfm_kin &k, const double *load, double *u_s) {
  warn_softened(k.dt);
  rates = rates_of(k.dt);
  frames_of = k.t;
  step_of = k.dt;
  for (size_t i = 0; i < npoint; ++i) std::copy_n(k.x + i * k.stride, 3, position.data() + 3 * i);
  std::fill_n(momentum.data(), 6 * size_t(ncluster), 0.0);
  for (uint32_t c = 0; c < ncluster; ++c) fit(c, k);
  // change: what its clusters take of a point's velocity
  for (uint32_t i = 0; i < npoint; ++i) {
    double *const to = change.data() + 3 * size_t(i), *const u = velocity.data() + 3 * size_t(i);
    double away[3];
    to_goal(i, away);
    for (size_t a = 0; a < 3; ++a) {
      const double v = k.v[size_t(i) * k.stride + a], inv = inverse[3 * size_t(i) + a];
      const double kept = inv > 0 ? rates.drag * v : v;
      const double given = k.dt * inv * load[size_t(i) * k.stride + a];
      u[a] = (rates.kept * kept + rates.given * given) + rates.pulled * away[a];
      to[a] = ((1 - rates.kept) * kept + (1 - rates.given) * given) + rates.led * away[a];
    }
    add_momentum(i, to);
  }
  for (uint32_t c = 0; c < ncluster; ++c) make_rigid(c);
  for (uint32_t i = 0; i < npoint; ++i) {
    double rigid[3], *const u = velocity.data() + 3 * size_t(i);
    rigid_velocity(i, rigid);
    for (size_t a = 0; a < 3; ++a)
      u[a] = inverse[3 * size_t(i) + a] > 0 ? u[a] + rigid[a] : k.v[size_t(i) * k.stride + a];
  }
  std::fill_n(change.data(), 3 * size_t(npoint), 0.0);
  std::fill_n(momentum.data(), 6 * size_t(ncluster), 0.0);
  for (uint32_t s = 0; s < nsurfel; ++s)
    for (size_t a = 0; a < 3; ++a) {
      double sum = 0;
      for (uint32_t e = row[s]; e < row[s + 1]; ++e) sum += coupling[e] * velocity[3 * size_t(col[e]) + a];
      u_s[3 * size_t(s) + a] = sum;
    }
}

void Body::touch(uint32_t n, const uint32_t *surfel) {
  for (uint32_t s = 0; s < n; ++s)
    for (uint32_t e = row[surfel[s]]; e < row[surfel[s] + 1]; ++e) {
      const uint32_t i = col[e];
      if (is_touched[i]) continue;
      is_touched[i] = 1;
      touched[ntouched++] = i;
      for (uint32_t m = point_begin[i]; m < point_begin[i + 1]; ++m) {
        const uint32_t c = point_cluster[m];
        if (is_met[c]) continue;
        is_met[c] = 1;
        met[nmet++] = c;
      }
    }
}

void Body::forget() {
  for (; ntouched; --ntouched) {
    const uint32_t i = touched[ntouched - 1];
    is_touched[i] = 0;
    std::fill_n(change.data() + 3 * size_t(i), 3, 0.0);
  }
  for (; nmet; --nmet) {
    const uint32_t c = met[nmet - 1];
    is_met[c] = 0;
    std::fill_n(momentum.data() + 6 * size_t(c), 6, 0.0);
  }
}

// The clusters' rigid velocities, by impulses at surfels whose points are touched.
void Body::push(uint32_t n, const uint32_t *surfel, const double *p) {
  for (uint32_t t = 0; t < ntouched; ++t) std::fill_n(change.data() + 3 * size_t(touched[t]), 3, 0.0);
  for (uint32_t t = 0; t < nmet; ++t) std::fill_n(momentum.data() + 6 * size_t(met[t]), 6, 0.0);
  for (uint32_t s = 0; s < n; ++s)
    for (uint32_t e = row[surfel[s]]; e < row[surfel[s] + 1]; ++e)
      for (size_t a = 0; a < 3; ++a) {
        const size_t at = 3 * size_t(col[e]) + a;
        change[at] += inverse[at] * (coupling[e] * p[3 * size_t(s) + a]);
      }
  for (uint32_t t = 0; t < ntouched; ++t) add_momentum(touched[t], change.data() + 3 * size_t(touched[t]));
  for (uint32_t t = 0; t < nmet; ++t) make_rigid(met[t]);
}

// What a point's velocity changes by.
void Body::changed(uint32_t point, double *out) const {
  rigid_velocity(point, out);
  for (size_t a = 0; a < 3; ++a) {
    const size_t at = 3 * size_t(point) + a;
    out[a] = inverse[at] > 0 ? rates.given * change[at] + (1 - rates.given) * out[a] : 0;
  }
}

void Body::respond(const dfm_kin &, uint32_t n, const uint32_t *surfel, uint32_t nrhs, const double *p,
                   double *du) {
  touch(n, surfel);
  for (uint32_t r = 0; r < nrhs; ++r, p += 3 * size_t(n), du += 3 * size_t(n)) {
    push(n, surfel, p);
    for (uint32_t t = 0; t < ntouched; ++t) changed(touched[t], matched.data() + 3 * size_t(touched[t]));
    for (uint32_t s = 0; s < n; ++s)
      for (size_t a = 0; a < 3; ++a) {
        double sum = 0;
        for (uint32_t e = row[surfel[s]]; e < row[surfel[s] + 1]; ++e)
          sum += coupling[e] * matched[3 * size_t(col[e]) + a];
        du[3 * size_t(s) + a] = sum;
      }
  }
  forget();
}

// A bound: without clusters, the points alone would answer more.
void Body::diagonal(const dfm_kin &, uint32_t n, const uint32_t *surfel, double *w) const {
  std::fill(w, w + 9 * size_t(n), 0.0);
  for (uint32_t s = 0; s < n; ++s)
    for (uint32_t e = row[surfel[s]]; e < row[surfel[s] + 1]; ++e)
      for (size_t a = 0; a < 3; ++a)
        w[9 * size_t(s) + 4 * a] += coupling[e] * coupling[e] * inverse[3 * size_t(col[e]) + a];
}

void Body::commit(const dfm_kin &k, const double *p_s, double *x, double *v) {
  uint32_t n = 0;
  for (uint32_t s = 0; s < nsurfel; ++s) {
    const double *const p = p_s + 3 * size_t(s);
    if (p[0] == 0 && p[1] == 0 && p[2] == 0) continue;
    pushed[n] = s;
    std::copy_n(p, 3, push_by.data() + 3 * size_t(n++));
  }
  touch(n, pushed.data());
  push(n, pushed.data(), push_by.data());
  for (uint32_t i = 0; i < npoint; ++i) {
    const size_t at = size_t(i) * k.stride;
    double by[3];
    changed(i, by);
    for (size_t a = 0; a < k.stride; ++a) v[at + a] = x[at + a] = 0;
    for (size_t a = 0; a < 3; ++a) {
      v[at + a] = velocity[3 * size_t(i) + a] + by[a];
      x[at + a] = k.x[at + a] + k.dt * v[at + a];
    }
  }
  forget();
  if (k.state_out) flow(k);
}

// S_p <- (1 + (1 - e^(-creep h)) (S - 1)) S_p where |S - 1| is above the yield strain, S = R^T A; its volume
// is kept, and |S_p - 1| bounded.
void Body::flow(const dfm_kin &k) const {
  const double rate = 1 - dfm_exp(-params[kCreep] * k.dt), most = params[kPlasticMax];
  for (uint32_t c = 0; c < ncluster; ++c) {
    const Frame &f = frame[c];
    double *const out = k.state_out + kPlastic * size_t(c);
    double by[9], strain = 0, now[9], length = 0;
    for (int e = 0; e < 9; ++e) {
      const double d = f.stretch[e] - (e % 4 == 0);
      strain += d * d;
      by[e] = (e % 4 == 0) + rate * d;
    }
    std::copy_n(f.plastic, kPlastic, out);
    if (!(rate > 0 && f.volume > kCrushed && std::sqrt(strain) > params[kYield])) continue;
    matrix_product(by, f.plastic, now);
    const double volume = determinant(now);
    if (!(volume > 0)) continue;
    const double scale = dfm_pow(volume, -1.0 / 3);
    for (int e = 0; e < 9; ++e) {
      now[e] *= scale;
      const double d = now[e] - (e % 4 == 0);
      length += d * d;
    }
    length = std::sqrt(length);
    for (int e = 0; e < 9; ++e) {
      const double unit = e % 4 == 0;
      out[e] = length > most ? unit + (now[e] - unit) * (most / length) : now[e];
    }
  }
}

}  // namespace shape
