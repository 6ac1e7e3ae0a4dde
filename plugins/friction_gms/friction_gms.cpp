// Generalized Maxwell-slip friction: one to sixteen elements in parallel, each a spring k_i that slips at its
// share nu_i of the Stribeck level. Together they keep a nonlocal memory: an inner loop closes where it began
// (return points), which no law with one bristle does. Al-Bender, Lampaert, Swevers 2005, (6)-(8).
//
//   stuck     df/dt = k v                                until |f| = nu g(w)
//   slipping  df/dt = sgn v C (nu - |f|/g)               until v turns
//
// As vectors, by one radial return per element, which is these equations in one dimension. With K = k A, f0 =
// K z0 brought into the new cone nu F_S, and lambda = h C A:
//
//   ft = f0 + K h v,   f' = ft min(1, L/|ft|),
//   L = nu g  where the element was stuck,   L = g (|f0| + lambda nu)/(g + lambda)  where it slipped
//
// so the direction follows the displacement and the magnitude relaxes in time; what turns is stuck again by
// itself. F = sum f_i + sigma2 A v.
//
// At a crawl the force of a slipping element rises in time without motion (L > |ft|), up to nu F_S: the
// published law takes that work from nowhere, as much as sum nu_i^2 (F_S^2 - F_C^2)/(2 k_i). Here it is paid
// for: a budget E gathers what sliding dissipates, up to sum (nu_i F_S)^2/(2 K_i), and a step may rise by f'
// = ft + theta (L t - ft), theta = min(1, E/N), where N >= the elastic energy that this step could gain. A
// radial return loses energy and the loss is concave in f' along t, so with elastic energy plus E as storage
// the law is passive with any parameters (doc/decisions/friction_memory.md).
#include <algorithm>
#include <array>
#include <utility>

#include "../friction_common/curve.h"
#include "../friction_common/without.h"

namespace {

using lanes::kLanes;
using lanes::within;

constexpr uint32_t kMax = 16, kUsual = 4;  // elements
enum { kMuC, kMuS, kVs, kDelta, kSigma2, kC, kK, kNu = kK + kMax };
constexpr dfm_param kRows[] = {
    CURVE_ROWS,
    dfm::plugin::param("sigma2", "viscous friction per area", "N s/m^3", 0, 1e12, 0, DFM_PARAM_RUNTIME),
    dfm::plugin::param("C", "rate at which slipping elements approach their level, per area", "N/(s m^2)", 0,
                       1e15, 1e5, DFM_PARAM_RUNTIME),
    dfm::plugin::param("k", "stiffness of the elements per area, one for each; none: 4e7 3e7 2e7 1e7",
                       "N/m^3", 0, 1e15, 0, DFM_PARAM_RUNTIME | DFM_PARAM_LIST, kMax),
    dfm::plugin::param("nu", "shares of the level, together 1; none: 0.2 0.3 0.3 0.2", "1", 0, 1, 0,
                       DFM_PARAM_RUNTIME | DFM_PARAM_LIST, kMax),
};
constexpr double kUsualK[kUsual] = {4e7, 3e7, 2e7, 1e7}, kUsualNu[kUsual] = {0.2, 0.3, 0.3, 0.2};

// The state of n elements: n tangent pairs z_i (m); then n flags, 1 while the element slips, and the budget
// (J: an area that grows brings none).
constexpr uint32_t flag_of(uint32_t n) { return 2 * n; }
constexpr uint32_t budget_of(uint32_t n) { return 3 * n; }
struct Slots {
  dfm_slot slot[kMax + 1];
  constexpr explicit Slots(uint32_t n) : slot{} {
    for (uint32_t e = 0; e < n; ++e) slot[e] = {DFM_PER_CONTACT, 2, DFM_SLOT_TANGENT, 0};
    slot[n] = {DFM_PER_CONTACT, n + 1, DFM_SLOT_SCALAR, 0};
  }
};
template <size_t... N>
constexpr std::array<Slots, kMax> all_slots(std::index_sequence<N...>) {
  return {Slots(N + 1)...};
}
constexpr std::array<Slots, kMax> kSlots = all_slots(std::make_index_sequence<kMax>{});

uint32_t given(const double *p) {  // up to the last nonzero one
  uint32_t n = kMax;
  while (n > 0 && p[n - 1] == 0) --n;
  return n;
}
// Invalid parameters have no elements; this number keeps accesses within the arrays.
uint32_t elements(const double *params) {
  const uint32_t k = given(params + kK), nu = given(params + kNu);
  return std::max(k > 0 ? k : kUsual, nu > 0 ? nu : kUsual);
}

struct Batch {
  double h, mu_c, mu_s, v_s, delta, sigma2, c, k[kMax] = {}, nu[kMax] = {};
  uint32_t n;  // elements
  Batch(const double *p, double dt)
      : h(dt),
        mu_c(p[kMuC]),
        mu_s(p[kMuS]),
        v_s(p[kVs]),
        delta(p[kDelta]),
        sigma2(p[kSigma2]),
        c(p[kC]),
        n(elements(p)) {
    const bool own_k = given(p + kK) > 0, own_nu = given(p + kNu) > 0;
    std::copy_n(own_k ? p + kK : kUsualK, own_k ? n : kUsual, k);
    std::copy_n(own_nu ? p + kNu : kUsualNu, own_nu ? n : kUsual, nu);
  }
};

constexpr double kMin = 1e-140, kLargest = 1e140, kFar = 1e100, kWide = 1e20;  // as in bristle.h

struct Block {
  double nan_flag[kLanes], fn[kLanes], area[kLanes], vx[kLanes], vy[kLanes], w[kLanes], ex[kLanes],
      ey[kLanes], mu[kLanes], g[kLanes], slope[kLanes];
  // sums over elements
  double fx[kLanes], fy[kLanes], xx[kLanes], xy[kLanes], yx[kLanes], yy[kLanes], nx[kLanes], ny[kLanes],
      stored[kLanes], slips[kLanes];
  // J; theta: share of the rise that the budget covers
  double budget[kLanes], most[kLanes], theta[kLanes], theta_fn[kLanes], lost[kLanes];
};

DEFORM_PASS inline void load(const Batch &p, const dfm_friction_in *in, size_t at, Block &b) {
  const size_t stride = in->stride;
  const double *fn = in->fn + at, *vx = in->vt + at, *vy = vx + stride, *area = in->area + at;
  EACH_LANE (i) {
    b.nan_flag[i] = (0.0 * fn[i] + 0.0 * vx[i]) + (0.0 * vy[i] + 0.0 * area[i]);
    const double touches = fn[i] > kMin ? fn[i] : 0.0, a = area[i] > 0 ? area[i] : 0.0;
    b.fn[i] = touches < kLargest ? touches : kLargest;
    b.area[i] = a < kWide ? a : kWide;
    const double x = within(vx[i], kFar);
    const double y = within(vy[i], kFar);
    const double square = x * x + y * y;
    const double moves = square > kMin * kMin ? 1.0 : 0.0;
    b.vx[i] = x * moves;
    b.vy[i] = y * moves;
    b.w[i] = std::sqrt(square * moves);
    const double by_w = 1.0 / (b.w[i] > kMin ? b.w[i] : kMin);
    b.ex[i] = b.vx[i] * by_w;
    b.ey[i] = b.vy[i] * by_w;
    const double open = b.fn[i] > 0 ? 1.0 : 0.0, drag = open * (p.sigma2 * b.area[i]);
    b.fx[i] = drag * b.vx[i];
    b.fy[i] = drag * b.vy[i];
    b.xx[i] = b.yy[i] = drag;
    b.xy[i] = b.yx[i] = b.nx[i] = b.ny[i] = 0.0;
    b.stored[i] = b.slips[i] = 0.0;
  }
  double excess[kLanes] = {}, fall[kLanes] = {};
  if (p.mu_s != p.mu_c) lanes::curve(p.v_s, p.delta, b.w, excess, fall);
  EACH_LANE (i) {
    b.mu[i] = b.fn[i] > 0 ? p.mu_c + (p.mu_s - p.mu_c) * excess[i] : 0.0;
    b.g[i] = b.mu[i] * b.fn[i];
    b.slope[i] = (p.mu_s - p.mu_c) * b.fn[i] * fall[i] / (b.w[i] > kMin ? b.w[i] : kMin);  // g'(w)
  }
}

// The share of this step's rise that the budget covers. N from the old state alone, so that theta has no
// slope by v: |f'| <= |f0| + lambda nu.
DEFORM_PASS inline void pay(const Batch &p, const dfm_friction_in *in, size_t at, Block &b) {
  const size_t stride = in->stride;
  const double *const budget = in->state + budget_of(p.n) * stride + at;
  double need[kLanes] = {};
  EACH_LANE (i) b.most[i] = b.lost[i] = 0.0;
  for (uint32_t e = 0; e < p.n; ++e) {
    const double *zx = in->state + 2 * e * stride + at;
    const double *zy = zx + stride;
    const double *flag = in->state + (flag_of(p.n) + e) * stride + at;
    const double nu = p.nu[e];
    EACH_LANE (i) {
      const double K = p.k[e] * b.area[i];
      const double by_2k = 0.5 / (K > kMin ? K : kMin);
      const double cone = nu * p.mu_s * b.fn[i];
      const double x = within(zx[i], kFar), y = within(zy[i], kFar), rise = p.h * p.c * b.area[i] * nu;
      need[i] += flag[i] > 0.5 ? rise * (2.0 * (K * std::sqrt(x * x + y * y)) + rise) * by_2k : 0.0;
      b.most[i] += cone * cone * by_2k;
    }
  }
  EACH_LANE (i) {
    b.nan_flag[i] += 0.0 * budget[i];
    const double given = budget[i] > 0 ? budget[i] : 0.0;
    b.budget[i] = given < b.most[i] ? given : b.most[i];
    b.theta[i] = b.budget[i] < need[i] ? b.budget[i] / need[i] : 1.0;
    // the bound is proportional to fn^2
    b.theta_fn[i] =
        b.theta[i] < 1.0 && given > b.most[i] ? 2.0 * b.theta[i] / (b.fn[i] > 0 ? b.fn[i] : kLargest) : 0.0;
  }
}

// Element e of eight contacts: its new deflection and its contribution to the sums.
DEFORM_PASS inline void element(const Batch &p, uint32_t e, const dfm_friction_in *in, dfm_friction_out *out,
                                size_t at, Block &b) {
  const size_t stride = in->stride;
  const double *zx = in->state + 2 * e * stride + at;
  const double *zy = zx + stride;
  const double *flag = in->state + (flag_of(p.n) + e) * stride + at;
  const double nu = p.nu[e];
  double spare[kLanes];
  const auto to = [&](size_t c) { return out->state ? out->state + c * stride + at : spare; };
  double *const ox = to(2 * e), *const oy = to(2 * e + 1), *const oflag = to(flag_of(p.n) + e);
  EACH_LANE (i) {
    b.nan_flag[i] += (0.0 * zx[i] + 0.0 * zy[i]) + 0.0 * flag[i];
    const double K = p.k[e] * b.area[i];
    const double hk = p.h * K;
    const double g = b.g[i];
    const double keeps = b.fn[i] > 0 ? 1.0 : 0.0;
    const double cone = nu * p.mu_s * b.fn[i];
    const double ax = K * (keeps * within(zx[i], kFar));
    const double ay = K * (keeps * within(zy[i], kFar));
    const double a2 = ax * ax + ay * ay;
    // brings the old force into the new cone
    const double size = std::sqrt(a2 > kMin * kMin ? a2 : 1.0);
    const double r = a2 > kMin * kMin ? size : 0.0;
    const double outside = r > cone ? 1.0 : 0.0;
    const double scale = outside > 0 ? cone / size : 1.0;
    const double x0 = scale * (keeps * within(zx[i], kFar));
    const double y0 = scale * (keeps * within(zy[i], kFar));
    const double f0 = outside > 0 ? cone : r;
    const double by_fn = outside / (b.fn[i] > 0 ? b.fn[i] : kLargest);
    const double cx = K * x0 * by_fn;
    const double cy = K * y0 * by_fn;  // df0/dfn
    // trial and limit
    const double tx = x0 + p.h * b.vx[i];
    const double ty = y0 + p.h * b.vy[i];
    const double px = K * tx;
    const double py = K * ty;
    const double t2 = px * px + py * py;
    const double t = std::sqrt(t2 > kMin * kMin ? t2 : 1.0);
    const double n = t2 > kMin * kMin ? t : 0.0;
    const double ux = n > 0 ? px / t : 0.0;
    const double uy = n > 0 ? py / t : 0.0;
    const double forward = x0 * b.vx[i] + y0 * b.vy[i] > 0 ? 1.0 : 0.0, was = flag[i] > 0.5 ? forward : 0.0;
    const double rate = p.h * p.c * b.area[i];
    const double sum = g + rate;
    const double by_sum = 1.0 / (sum > kMin * 1e-10 ? sum : kMin * 1e-10);
    const double goal = f0 + rate * nu;
    const double limit = was > 0 ? g * by_sum * goal : nu * g;
    const double by_g = was > 0 ? rate * by_sum * (goal * by_sum) : nu, by_f0 = was > 0 ? g * by_sum : 0.0;
    const double rises = was > 0 && n < limit && n > 0 ? keeps : 0.0;
    const double beyond = n > limit ? keeps : 0.0;
    const double moved = beyond + rises * b.theta[i];
    const double q = n > 0 ? limit / t : 1.0;
    const double whole = (1.0 - moved) * keeps;
    const double scale1 = whole + moved * q;
    const double qx = tx * scale1;
    const double qy = ty * scale1;
    // derivatives: K h on the trial, K h q (1 - u u^T) + u dL^T on the limit
    const double gx = by_g * b.slope[i] * b.ex[i];
    const double gy = by_g * b.slope[i] * b.ey[i];
    const double along = hk * q;
    const double stays = hk * whole;
    b.xx[i] += stays + moved * (along * (1.0 - ux * ux) + ux * gx);
    b.xy[i] += moved * (ux * gy - along * ux * uy);
    b.yx[i] += moved * (uy * gx - along * ux * uy);
    b.yy[i] += stays + moved * (along * (1.0 - uy * uy) + uy * gy);
    const double turn = ux * cx + uy * cy, level = by_g * b.mu[i] + by_f0 * (f0 * by_fn);
    const double paid = rises * b.theta_fn[i] * (q - 1.0);
    b.nx[i] += whole * cx + moved * (ux * level + q * (cx - turn * ux)) + paid * px;
    b.ny[i] += whole * cy + moved * (uy * level + q * (cy - turn * uy)) + paid * py;
    b.fx[i] += K * qx;
    b.fy[i] += K * qy;
    b.stored[i] += 0.5 * (K * qx * qx + K * qy * qy);
    // work less gain
    b.lost[i] +=
        K * (qx * (tx - x0) + qy * (ty - y0)) - 0.5 * K * ((qx - x0) * (qx + x0) + (qy - y0) * (qy + y0));
    const double slipping = beyond > 0 ? 1.0 : was * keeps;
    b.slips[i] += slipping;
    ox[i] = qx;
    oy[i] = qy;
    oflag[i] = slipping;
  }
}

struct Gms {
  DEFORM_PASS static dfm_status run(const dfm_friction_in *in, dfm_friction_out *out) {
    const Batch p(in->params, in->dt);
    const size_t stride = in->stride;
    double spare[kLanes];
    for (size_t at = 0; at < in->n; at += kLanes) {
      Block b;
      load(p, in, at, b);
      pay(p, in, at, b);
      for (uint32_t e = 0; e < p.n; ++e) element(p, e, in, out, at, b);
      const auto to = [&](double *column, size_t c) { return column ? column + c * stride + at : spare; };
      double *const fx = to(out->ft, 0);
      double *const fy = to(out->ft, 1);
      double *const xx = to(out->dft_dvt, 0);
      double *const xy = to(out->dft_dvt, 1);
      double *const yx = to(out->dft_dvt, 2);
      double *const yy = to(out->dft_dvt, 3);
      double *const nx = to(out->dft_dfn, 0);
      double *const ny = to(out->dft_dfn, 1);
      double *const limit = to(out->limit, 0);
      double *const stored = to(out->stored, 0);
      double *const budget = to(out->state, budget_of(p.n));
      EACH_LANE (i) {
        const double nan_flag = b.nan_flag[i], drag = b.fn[i] > 0 ? p.sigma2 * b.area[i] : 0.0;
        fx[i] = nan_flag - b.fx[i];
        fy[i] = nan_flag - b.fy[i];
        xx[i] = nan_flag - b.xx[i];
        xy[i] = nan_flag - b.xy[i];
        yx[i] = nan_flag - b.yx[i];
        yy[i] = nan_flag - b.yy[i];
        nx[i] = nan_flag - b.nx[i];
        ny[i] = nan_flag - b.ny[i];
        limit[i] = p.mu_s * b.fn[i] + drag * b.w[i] + nan_flag;
        const double rest = b.budget[i] + b.lost[i];
        const double left = rest > 0 ? rest < b.most[i] ? rest : b.most[i] : 0.0;
        budget[i] = left;
        stored[i] = b.stored[i] + left + nan_flag;
      }
      for (uint32_t c = 0; out->state && c < budget_of(p.n) + 1; ++c)
        EACH_LANE (i) out->state[c * stride + at + i] += b.nan_flag[i];
      for (uint32_t i = 0; out->mode && i < kLanes; ++i)
        out->mode[at + i] = static_cast<uint8_t>(b.fn[i] > 0 ? b.slips[i] > p.n - 0.5 ? 2 : 1 : 0);
    }
    return DFM_OK;
  }
};

dfm_status check(const double *p, char *why, size_t cap) {
  const double *const k = p + kK, *const nu = p + kNu;
  const uint32_t nk = given(k), nnu = given(nu), n = elements(p);
  if (const dfm_status s = lanes::check(p, why, cap); s != DFM_OK) return s;
  if (nk > 0 && nnu > 0 && nk != nnu) {
    std::snprintf(why, cap,
                  "k has %u value%s and nu has %u (zeros at the end do not count); give as many of each, one "
                  "for each element",
                  nk, nk == 1 ? "" : "s", nnu);
    return DFM_E_ARG;
  }
  if ((nk == 0) != (nnu == 0) && nk + nnu != kUsual) {
    std::snprintf(why, cap, "%s %u value%s and %s has none, which means four; give as many of each",
                  nk ? "k has" : "nu has", nk ? nk : nnu, (nk ? nk : nnu) == 1 ? "" : "s", nk ? "nu" : "k");
    return DFM_E_ARG;
  }
  double sum = 0;
  for (uint32_t e = 0; e < n; ++e) sum += nu[e];
  if (nnu > 0 && std::fabs(sum - 1) > 1e-9) {
    std::snprintf(why, cap, "the %u nu must add up to 1; their sum is %.12g", nnu, sum);
    return DFM_E_ARG;
  }
  for (uint32_t e = 0; e < n; ++e)
    if (nk > 0 && !(k[e] > 0)) {
      std::snprintf(why, cap, "k must be above zero for each of the %u elements; it is %g for element %u", n,
                    k[e], e + 1);
      return DFM_E_ARG;
    }
  return DFM_OK;
}

const dfm_slots *state(const double *params) {
  static constexpr std::array<dfm_slots, kMax> tables = [] {
    std::array<dfm_slots, kMax> out{};
    for (uint32_t n = 1; n <= kMax; ++n) out[n - 1] = {sizeof(dfm_slots), n + 1, kSlots[n - 1].slot, 0, 0};
    return out;
  }();
  return &tables[elements(params) - 1];
}

constexpr dfm_friction make() {
  dfm_friction f = dfm::plugin::friction(DFM_NEED_FN | DFM_NEED_VT | DFM_NEED_AREA,
                                         DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_JACOBIAN,
                                         lanes::eval<Gms>, check);
  f.nslot = kMax + 1;
  f.slots = kSlots[kMax - 1].slot;
  f.state = state;
  f.without = without::level<kMuC, kMuS, kSigma2>;
  return f;
}

const dfm_friction law = make();
const char *const effects[] = {"stiction",   "stribeck",  "viscous", "presliding",
                               "hysteresis", "breakaway", nullptr};
const dfm_type gms = dfm::plugin::type(
    DFM_KIND_FRICTION, "org.deform.gms",
    "Generalized Maxwell-slip friction: up to 16 elements, nonlocal memory", "0.1.0", "MIT",
    "Al-Bender, Lampaert, Swevers 2005, (6)-(8); vector form by radial returns, its rise at a crawl paid for",
    kRows, effects, &law);

}  // namespace

DFM_PLUGIN(&gms)
