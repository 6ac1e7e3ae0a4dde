// Dahl friction: an elastic bristle whose stiffness falls with the force, rate-independent, without stiction
// level. P. R. Dahl 1968/1976; Zerbato 2010, (5.8)-(5.9) corrected: sigma in both terms, and |q|^alpha sgn q,
// which neither runs away nor turns into NaN beyond F_C. One dimension:
//
//   dF/dt = sigma v |q|^alpha sgn q,   q = 1 - F sgn v / F_C
//
// As vectors: q = 1 - u.v^, u = K0 z / F_C, and the plastic rate m = w c(q), c = (1 - |q|^alpha sgn q)/(1 -
// q), is that equation in one dimension, isotropic and continuous in two, and dissipative because c >= 0.
// alpha = 1 gives c = 1. Otherwise the implicit return of bristle.h is one equation in the share rho = |K0
// z'|/F_C along the trial direction t, with kappa = t.v^ and f(rho) = rho c(1 - kappa rho):
//
//   rho + p f(rho) = rho_t,   p = h K0 w/F_C;
//   times kappa, with q = 1 - kappa rho:   q + p |q|^alpha sgn q = R,   R = 1 + p - kappa rho_t
//
// whose left side is odd and grows: q has the sign of R, and y = |q| is the one root of y + p y^alpha = |R|.
// Both terms bound it, y <= |R| and y <= (|R|/p)^(1/alpha); the smaller is at most twice the root, and from
// there Newton steps on a convex curve come down to it without overshoot, eight lanes at a time; a lane that
// has converged stays as it is. Then rho = rho_t/(1 + p c(q)) loses no digits where kappa vanishes. Below 1
// the exponent would let a bristle that turns leave the cone, so the range begins there.
#include "../friction_common/bristle.h"

namespace {

enum { kMuC, kSigma0, kAlpha, kCount };
constexpr dfm_param kRows[kCount] = {
    dfm::plugin::param("mu_C", "friction coefficient", "1", 0, 100, 0.5, DFM_PARAM_RUNTIME),
    dfm::plugin::param("sigma0", "bristle stiffness per area", "N/m^3", 1, 1e15, 1e8,
                       DFM_PARAM_RUNTIME | DFM_PARAM_LOG_SCALE),
    dfm::plugin::param("alpha", "exponent of the loading curve", "1", 1, 10, 1, DFM_PARAM_RUNTIME),
};

using bristle::Block;
using bristle::kLanes;

// |q|^a, 0 where it has vanished.
DEFORM_PASS inline double power(double size, double a) {
  const double s = lanes::power(size > 1e-150 ? size : 1e-150, a);
  return size > 1e-150 ? s : 0.0;
}

// The return in shares of the level. A step of many bristle lengths makes p and top = rho_t large and nearly
// equal, so their difference and those of the directions t and v^ come from the old bristle u: beyond = top -
// p, aside = 1 - kappa, (lx, ly) = t - v^.
struct Trial {
  double on[kLanes], r[kLanes], ux[kLanes], uy[kLanes], p[kLanes], top[kLanes], kappa[kLanes], aside[kLanes],
      lx[kLanes], ly[kLanes], R[kLanes], y[kLanes];
};

DEFORM_PASS inline void trial(double a, const bristle::Batch &batch, const Block &b, Trial &t) {
  const double by_a = 1.0 / a;
  EACH_LANE (i) {
    const double tx = b.zx[i] + batch.h * b.vx[i];
    const double ty = b.zy[i] + batch.h * b.vy[i];
    const double size = std::sqrt(tx * tx + ty * ty);
    const double g = b.g[i];
    const double w = b.w[i];
    const double k0 = b.k0[i];
    // deflection too small for the exponent to matter: unchanged
    const double loaded = g > 0 ? 1.0 : 0.0;
    const double moving = w > 0 ? loaded : 0.0;
    const double on = k0 * size > 1e-100 * g ? moving : 0.0;
    const double by_g = 1.0 / (on > 0 ? g : 1.0);
    const double r = on > 0 ? size : 1.0;
    const double by_r = 1.0 / r;
    const double ux = tx * by_r;
    const double uy = ty * by_r;
    const double ex = b.ex[i];
    const double ey = b.ey[i];
    const double p = on > 0 ? batch.h * k0 * w * by_g : 1.0;
    const double top = on > 0 ? k0 * r * by_g : 1.0;
    const double ox = k0 * b.zx[i] * by_g;
    const double oy = k0 * b.zy[i] * by_g;
    const double n = ox * ox + oy * oy;
    const double s = ox * ex + oy * ey;
    const double by_top = 1.0 / top;
    const double beyond = (n + 2.0 * p * s) / (top + p);
    const double aside = (n - s * beyond) / (top + p) * by_top;
    const double kappa = ux * ex + uy * ey;
    t.on[i] = on;
    t.r[i] = r;
    t.ux[i] = ux;
    t.uy[i] = uy;
    t.p[i] = p;
    t.top[i] = top;
    t.kappa[i] = kappa;
    t.aside[i] = aside;
    t.lx[i] = (ox - beyond * ex) * by_top;
    t.ly[i] = (oy - beyond * ey) * by_top;
    t.R[i] = on > 0 ? 1.0 + (p * aside - kappa * beyond) : 1.0;
  }
  EACH_LANE (i) {
    const double size = std::fabs(t.R[i]);
    const double ratio = size / t.p[i];
    const double root = power(ratio < 1e280 ? ratio : 1e280, by_a);
    t.y[i] = root < size ? root : size;
  }
}

DEFORM_PASS inline void solve(double a, Trial &t) {
  double active[kLanes];
  uint64_t any = 1;
  EACH_LANE (i) active[i] = t.on[i];
  for (int pass = 0; pass < 60 && any; ++pass) {
    any = 0;
    EACH_LANE (i) {
      const double y = t.y[i], s = power(y, a), by_y = 1.0 / (y > 1e-150 ? y : 1e-150);
      const double to = y - ((y - std::fabs(t.R[i])) + t.p[i] * s) / (1.0 + a * (t.p[i] * s) * by_y);
      const double next = active[i] > 0 ? to : y;
      active[i] = y - next > 4e-16 * y ? active[i] : 0.0;
      any |= active[i] > 0 ? uint64_t(1) : uint64_t(0);
      t.y[i] = next > 0 ? next : 0.0;
    }
  }
}

// m = w c(1 - kappa rho), so dm = c dw - w c' (kappa drho + rho dkappa), and from the return, with f' = alpha
// |q|^(alpha - 1),
//   (1 + p f') drho = drho_t - f dp + p rho^2 c' dkappa,
//   drho_t - f dp = (h K0/F_C) (t - f v^) . dv + (K0 t.dz0 - rho dF_C)/F_C
// Near q = 1 the quotients for c and c' lose digits by cancellation; their series do not.
DEFORM_PASS inline void rates(double a, const bristle::Batch &batch, const Trial &t, Block &b) {
  const double c1 = a * (a - 1) / 2, c2 = c1 * (a - 2) / 3;
  EACH_LANE (i) {
    const double y = t.y[i];
    const double q = t.R[i] < 0 ? -y : y;
    const double x = 1.0 - q;
    const double close = std::fabs(x) < 1e-5 ? 1.0 : 0.0;
    const double by_x = 1.0 / (close > 0 ? 1.0 : x);
    const double s = power(y, a);
    const double force = t.R[i] < 0 ? -s : s;
    const double far_value = (1.0 - force) * by_x;
    const double near_value = a - x * (c1 - x * c2);
    const double steep = a * s / (y > 1e-150 ? y : 1e-150);
    const double far_slope = (far_value - steep) * by_x;
    const double near_slope = c1 - 2.0 * x * c2;
    const double c = close > 0 ? near_value : far_value, slope = close > 0 ? near_slope : far_slope;
    const double p = t.p[i];
    const double kappa = t.kappa[i];
    const double aside = t.aside[i];
    const double rho = t.top[i] / (1.0 + p * c);
    const double ahead = kappa > 0.5 ? 1.0 : 0.0;
    const double along_lack = (force - aside) / (ahead > 0 ? kappa : 1.0);
    const double lack = ahead > 0 ? along_lack : 1.0 - rho * c;  // 1 - f
    const double w = b.w[i];
    const double by_w = b.by_w[i];
    const double by_g = 1.0 / (t.on[i] > 0 ? b.g[i] : 1.0);
    const double by_r = 1.0 / t.r[i];
    const double hk = batch.h * b.k0[i] * by_g;
    const double ux = t.ux[i];
    const double uy = t.uy[i];
    const double lx = t.lx[i];
    const double ly = t.ly[i];
    const double ex = b.ex[i];
    const double ey = b.ey[i];
    const double hr = batch.h * by_r;
    const double by_sum = 1.0 / (1.0 + p * steep), bends = p * rho * rho * slope, falls = w * slope;
    const double kx = hr * (aside * ux - lx) + (lx + aside * ex) * by_w;
    const double ky = hr * (aside * uy - ly) + (ly + aside * ey) * by_w;
    const double rx = by_sum * (hk * (lx + lack * ex) + bends * kx);
    const double ry = by_sum * (hk * (ly + lack * ey) + bends * ky);
    const double ox = b.cut[i] * b.zx[i], oy = b.cut[i] * b.zy[i], along = ux * ox + uy * oy;
    const double kn = (ex * (ox - along * ux) + ey * (oy - along * uy)) * by_r;
    const double rn = by_sum * ((b.k0[i] * along - rho * b.mu[i]) * by_g + bends * kn);
    const double mx = c * ex - falls * (kappa * rx + rho * kx);
    const double my = c * ey - falls * (kappa * ry + rho * ky);
    const double mn = -falls * (kappa * rn + rho * kn);
    b.m[i] = t.on[i] > 0 ? w * c : w;
    b.mx[i] = t.on[i] > 0 ? mx : ex;
    b.my[i] = t.on[i] > 0 ? my : ey;
    b.mn[i] = t.on[i] > 0 ? mn : 0.0;
  }
}

struct Dahl : bristle::Run<Dahl> {
  static bristle::Batch batch(const double *p) {
    return {0, p[kMuC], p[kMuC], 1, 2, p[kSigma0], 0, bristle::kConstant, 1, 0};
  }
  static constexpr dfm::plugin::Check check = nullptr;
  static constexpr decltype(dfm_friction::prepare) prepare = nullptr;
  static constexpr decltype(dfm_friction::release) release = nullptr;

  static constexpr bool kFlat = true;
  DEFORM_PASS static bool flow(const double *params, const bristle::Batch &p, Block &b) {
    const double a = params[kAlpha];
    if (a == 1.0) return false;
    Trial t;
    trial(a, p, b, t);
    solve(a, t);
    rates(a, p, t, b);
    return true;
  }
};

const dfm_friction law = bristle::ops<Dahl>();
const char *const effects[] = {"presliding", "hysteresis", nullptr};
const dfm_type dahl = dfm::plugin::type(
    DFM_KIND_FRICTION, "org.deform.dahl", "Dahl friction: a bristle that yields, rate-independent", "0.1.0",
    "MIT",
    "Dahl 1968, 1976; Zerbato 2010, (5.8)-(5.9) corrected: sigma in both terms, signed power; vector form",
    kRows, effects, &law);

}  // namespace

DFM_PLUGIN(&dahl)
