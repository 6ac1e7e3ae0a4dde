// Forces and energy. Of point i with neighbors j, F = sum (x_j - x_i) slope_j^T and what the fit leaves of
// each, r_j = (x_j - x_i) - F (X_j - X_i):
//   W_i = volume psi(F) + residual/2 sum w_j |r_j|^2.
// F is the fit of least squares with the weights w, so sum w_j r_j (X_j - X_i)^T = 0, and the gradient is
//   dW_i/dx_j = volume P slope_j + residual w_j r_j,   dW_i/dx_i = - the sum of these.
// Dampers: volume damping C:E' of Green's strain rate E' = sym(F^T F'), and of the residuals' rate what no
// turn of all of them explains, r' - t x r with sum w r x (r' - t x r) = 0. Both leave rigid motions alone.
// One pass finds what belongs to a point, the next adds up what acts on it: any cut gives the same bits.
#include "meshless_body.h"

#include <cmath>

#include "../model_common/rotation.h"

namespace meshless {

namespace {

// From this number of points on passes go through the host's parallel_for, in pieces of kGrain.
constexpr uint32_t kParallelPoints = 2000, kGrain = 64;
constexpr double kSmall = 1e-24;  // residuals that turn nothing: their square over that of the offsets

using model::matrix_product;
using model::transposed_matrix_product;

void add_product(const double *a, const double *x, double *out) {
  for (int i = 0; i < 3; ++i) out[i] += (a[3 * i] * x[0] + a[3 * i + 1] * x[1]) + a[3 * i + 2] * x[2];
}

}  // namespace

void shape_of(const double *f, Shape &out) {
  double s[3][3];
  model::split(f, out.rotation, s);
  model::jacobi(s, out.axis);
  for (int i = 0; i < 3; ++i) out.stretch[i] = s[i][i];
}

// corotational: mu |S - 1|^2 + lambda/2 (tr S - 3)^2, P = 2 mu (F - R) + lambda (tr S - 3) R
// green: mu E:E + lambda/2 (tr E)^2, E = (F^T F - 1)/2, P = F (2 mu E + lambda tr E)
void stress_of(Strain strain, const Solid &c, const double *f, double *out) {
  double r[9], s[9];
  if (strain == kGreen) {
    transposed_matrix_product(f, f, s);
    for (int k = 0; k < 9; ++k) s[k] = 0.5 * (s[k] - (k % 4 == 0));
    const double pressure = c.lambda * ((s[0] + s[4]) + s[8]);
    for (int k = 0; k < 9; ++k) s[k] = 2 * c.mu * s[k] + (k % 4 == 0 ? pressure : 0);
    return matrix_product(f, s, out);
  }
  model::rotation::polar_of(f, r);
  double change = -3;
  for (int k = 0; k < 9; ++k) change += r[k] * f[k];
  for (int k = 0; k < 9; ++k) out[k] = 2 * c.mu * (f[k] - r[k]) + c.lambda * change * r[k];
}

void Body::gradient_of(const double *x, uint32_t stride, uint32_t point, double *out) const {
  const double *const own = x + size_t(stride) * point;
  for (int k = 0; k < 9; ++k) out[k] = 0;
  for (uint32_t n = begin[point]; n < begin[point + 1]; ++n) {
    const double *const at = x + size_t(stride) * neighbor[n], *const g = slope.data() + 3 * size_t(n);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) out[3 * i + j] += (at[i] - own[i]) * g[j];
  }
}

// The residual of x with its gradient, or of v with its rate.
static void residual_of(const double *x, uint32_t stride, uint32_t i, uint32_t j, const double *gradient,
                        const double *away, double *out) {
  const double *const own = x + size_t(stride) * i, *const at = x + size_t(stride) * j;
  for (int a = 0; a < 3; ++a)
    out[a] = (at[a] - own[a]) -
             ((gradient[3 * a] * away[0] + gradient[3 * a + 1] * away[1]) + gradient[3 * a + 2] * away[2]);
}

void Body::residual(const dfm_kin &k, uint32_t point, uint32_t place, double *out) const {
  double away[3];
  offset(point, place, away);
  residual_of(k.x, k.stride, point, neighbor[place], gradient.data() + 9 * size_t(point), away, out);
}

// residual w (r + damping (r' - t x r)) of every neighbor.
void Body::find_pulls(const dfm_kin &k, uint32_t point) {
  const Solid &c = solid[point];
  for (uint32_t n = begin[point]; n < begin[point + 1]; ++n)
    residual(k, point, n, pull.data() + 3 * size_t(n));
  double t[3] = {};
  if (c.damping > 0) {
    double inverse[9], moment[3] = {};
    turning_inverse(pull.data() + 3 * size_t(begin[point]), point, inverse);
    for (uint32_t n = begin[point]; n < begin[point + 1]; ++n) {
      const double *const r = pull.data() + 3 * size_t(n), w = weight[n];
      double *const change = pull_rate.data() + 3 * size_t(n);
      double away[3];
      offset(point, n, away);
      residual_of(k.v, k.stride, point, neighbor[n], rate.data() + 9 * size_t(point), away, change);
      for (int a = 0; a < 3; ++a)
        moment[a] += w * (r[(a + 1) % 3] * change[(a + 2) % 3] - r[(a + 2) % 3] * change[(a + 1) % 3]);
    }
    add_product(inverse, moment, t);
  }
  for (uint32_t n = begin[point]; n < begin[point + 1]; ++n) {
    double *const r = pull.data() + 3 * size_t(n);
    const double *const change = pull_rate.data() + 3 * size_t(n), stiff = c.residual * weight[n];
    const double turned[3] = {t[1] * r[2] - t[2] * r[1], t[2] * r[0] - t[0] * r[2],
                              t[0] * r[1] - t[1] * r[0]};
    for (int a = 0; a < 3; ++a)
      r[a] = stiff * (c.damping > 0 ? r[a] + c.damping * (change[a] - turned[a]) : r[a]);
  }
}

void Body::find_stress(const dfm_kin &k, uint32_t point) {
  const Solid &c = solid[point];
  double *const f = gradient.data() + 9 * size_t(point), *const p = stress.data() + 9 * size_t(point);
  gradient_of(k.x, k.stride, point, f);
  stress_of(strain(), c, f, p);
  if (c.damping > 0) {
    double *const change = rate.data() + 9 * size_t(point), e[9], s[9], damper[9];
    gradient_of(k.v, k.stride, point, change);
    transposed_matrix_product(f, change, e);
    const double pressure = c.lambda * ((e[0] + e[4]) + e[8]);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        s[3 * i + j] = c.damping * (c.mu * (e[3 * i + j] + e[3 * j + i]) + (i == j ? pressure : 0));
    matrix_product(f, s, damper);
    for (int n = 0; n < 9; ++n) p[n] += damper[n];
  }
  for (int n = 0; n < 9; ++n) p[n] *= c.volume;
  if (c.residual > 0) find_pulls(k, point);
}

// Inverse of sum w (|r|^2 - r r^T) on the turns that move the residuals [n,3] of the neighbors.
void Body::turning_inverse(const double *residuals, uint32_t point, double *out) const {
  double j[3][3] = {};
  for (uint32_t n = begin[point]; n < begin[point + 1]; ++n) {
    const double *const r = residuals + 3 * size_t(n - begin[point]);
    const double w = weight[n], square = (r[0] * r[0] + r[1] * r[1]) + r[2] * r[2];
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) j[a][b] += w * ((a == b ? square : 0) - r[a] * r[b]);
  }
  model::spectral_inverse(j, out,
                          [](double x, double most) { return x > kSmall && x > 1e-10 * most ? x : 0; });
}

void Body::add_force(const dfm_kin &k, double *f, uint32_t point) const {
  double sum[3] = {}, own[3];
  own_slope(point, own);
  const auto take = [&](uint32_t of, const double *g) {
    const double *const p = stress.data() + 9 * size_t(of);
    for (int a = 0; a < 3; ++a) sum[a] -= (p[3 * a] * g[0] + p[3 * a + 1] * g[1]) + p[3 * a + 2] * g[2];
  };
  take(point, own);
  const bool residuals = solid[point].residual > 0;
  for (uint32_t n = begin[point]; residuals && n < begin[point + 1]; ++n)
    for (size_t a = 0; a < 3; ++a) sum[a] += pull[3 * size_t(n) + a];
  for (uint32_t b = back_begin[point]; b < back_begin[point + 1]; ++b) {
    const auto [i, n] = back[b];
    take(i, slope.data() + 3 * size_t(n));
    if (!(solid[i].residual > 0)) continue;
    for (size_t a = 0; a < 3; ++a) sum[a] -= pull[3 * size_t(n) + a];
  }
  double *const out = f + size_t(k.stride) * point;
  const double *const v = k.v + size_t(k.stride) * point, drag = drag_on ? solid[point].drag : 0;
  for (int a = 0; a < 3; ++a) out[a] += drag > 0 ? sum[a] - drag * v[a] : sum[a];
}

template <class F>
void Body::for_points(const F &f) const {
  model::in_pieces(host, npoint >= kParallelPoints, npoint, kGrain, [&](uint32_t first, uint32_t end) {
    for (uint32_t i = first; i < end; ++i) f(i);
  });
}

void Body::add_forces(const dfm_kin &k, double *f) {
  for_points([&](uint32_t i) { find_stress(k, i); });
  for_points([&](uint32_t i) { add_force(k, f, i); });
}

void Body::find_gradients(const dfm_kin &k) {
  for_points([&](uint32_t i) { gradient_of(k.x, k.stride, i, gradient.data() + 9 * size_t(i)); });
}

// J/m3, of the gradient.
double Body::density_at(uint32_t point) const {
  const Solid &c = solid[point];
  const double *const f = gradient.data() + 9 * size_t(point);
  Shape s;
  shape_of(f, s);
  double trace = 0, square = 0;
  for (const double x : s.stretch) {
    const double e = strain() == kGreen ? 0.5 * (x * x - 1) : x - 1;
    trace += e;
    square += e * e;
  }
  return c.mu * square + 0.5 * c.lambda * (trace * trace);
}

// J, of the gradient and of what it leaves.
double Body::energy_at(const dfm_kin &k, uint32_t point) const {
  double left = 0;
  for (uint32_t n = begin[point]; n < begin[point + 1]; ++n) {
    double r[3];
    residual(k, point, n, r);
    left += weight[n] * ((r[0] * r[0] + r[1] * r[1]) + r[2] * r[2]);
  }
  return solid[point].volume * density_at(point) + 0.5 * solid[point].residual * left;
}

double Body::energy(const dfm_kin &k) {
  find_gradients(k);
  double sum = 0;
  for (uint32_t i = 0; i < npoint; ++i) sum += energy_at(k, i);
  return sum;
}

// Each point's energy is shared among its cells by their volumes.
void Body::cell_energy(const dfm_kin &k, double *density) {
  find_gradients(k);
  for (uint32_t i = 0; i < npoint; ++i) shared[i] = around[i] > 0 ? energy_at(k, i) / around[i] : 0;
  for (size_t c = 0; c < ncell; ++c) {
    density[c] = 0;
    for (size_t a = 0; a < 4; ++a) density[c] += shared[cells[4 * c + a]] / 4;
  }
}

}  // namespace meshless
