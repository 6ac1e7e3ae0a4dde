// Dahl friction: an elastic bristle whose stiffness falls with the force, rate-independent, without stiction level. P. R. Dahl 1968/1976; Zerbato 2010,
// (5.8)-(5.9) corrected: sigma in both terms, and |q|^alpha sgn q, which neither runs away nor turns into NaN beyond F_C. One dimension:
//
//   dF/dt = sigma v |q|^alpha sgn q,   q = 1 - F sgn v / F_C
//
// As vectors: q = 1 - u.v^, u = K0 z / F_C, and the plastic rate m = w c(q), c = (1 - |q|^alpha sgn q)/(1 - q), is that equation in one dimension,
// isotropic and continuous in two, and dissipative because c >= 0. alpha = 1 gives c = 1. Otherwise the implicit return of bristle.h is one
// equation in the share rho = |K0 z'|/F_C along the trial direction t, with kappa = t.v^:
//
//   rho + p f(rho) = rho_t,   f(rho) = rho c(1 - kappa rho),   f' = alpha |1 - kappa rho|^(alpha - 1) >= 0,   p = h K0 w/F_C:
//
// one root, found by Newton in a bracket. Below 1 the exponent would let a bristle that turns leave the cone, so the range begins there.
#include "../friction_common/bristle.h"

namespace {

enum { kMuC, kSigma0, kAlpha, kCount };
constexpr dfm_param kRows[kCount] = {
    dfm::plugin::param("mu_C", "friction coefficient", "1", 0, 100, 0.5, DFM_PARAM_RUNTIME),
    dfm::plugin::param("sigma0", "bristle stiffness per area", "N/m^3", 1, 1e15, 1e8, DFM_PARAM_RUNTIME | DFM_PARAM_LOG_SCALE),
    dfm::plugin::param("alpha", "exponent of the loading curve", "1", 1, 10, 1, DFM_PARAM_RUNTIME),
};

// c(q) of exponent a and its slope by q. Near q = 1 both quotients lose their digits to a difference; their series do not.
struct Curve { double value, slope, power, force; };   // power = a |q|^(a - 1), force = |q|^a sgn q

Curve curve(double q, double a) {
  const double x = 1 - q, size = std::fabs(q);
  if (std::fabs(x) < 1e-5) {
    const double b = a * (a - 1) / 2, c = b * (a - 2) / 3;
    const double value = a - x * (b - x * c);
    return {value, b - 2 * x * c, a - x * (2 * b - 3 * x * c), 1 - x * value};
  }
  const double s = size > 1e-150 ? dfm_pow(size, a) : 0.0, power = size > 1e-150 ? a * s / size : 0.0, force = q < 0 ? -s : s, value = (1 - force) / x;
  return {value, (value - power) / x, power, force};
}

// The return in shares of the level: u the old bristle, top = rho_t. A step of many bristle lengths makes p and top large and nearly equal, so their
// difference and those of the directions t and v^ come from u: beyond = top - p, aside = 1 - kappa, (lx, ly) = t - v^.
struct Trial { double p, top, kappa, beyond, aside, lx, ly; };

Trial trial_of(double p, double top, double kappa, double ux, double uy, double ex, double ey) {
  const double n = ux * ux + uy * uy, s = ux * ex + uy * ey, beyond = (n + 2 * p * s) / (top + p);
  return {p, top, kappa, beyond, (n - s * beyond) / ((top + p) * top), (ux - beyond * ex) / top, (uy - beyond * ey) / top};
}

// 1 - f and the residual of rho + p f(rho) = top, without those differences.
struct Residual { Curve c; double lack, excess; };

Residual residual(const Trial &t, double rho, double a) {
  const bool far = t.kappa > 0.5;
  const Curve c = curve(far ? (1 - rho) + rho * t.aside : 1 - t.kappa * rho, a);
  const double lack = far ? (c.force - t.aside) / t.kappa : 1 - rho * c.value;
  return {c, lack, far ? rho - t.p * lack - t.beyond : rho + t.p * (rho * c.value) - t.top};
}

// The root in [0, min(top, 1)]: none leaves the cone.
double share_of(const Trial &t, double a) {
  double low = 0, high = t.top < 1 + 1e-15 ? t.top : 1 + 1e-15, rho = t.top / (1 + t.p);   // the root at alpha = 1
  for (int pass = 0; pass < 200; ++pass) {
    const Residual r = residual(t, rho, a);
    if (r.excess > 0) high = rho;
    else low = rho;
    const double next = rho - r.excess / (1 + t.p * r.c.power), to = next > low && next < high ? next : 0.5 * (low + high);
    if (!(std::fabs(to - rho) > 2e-16 * rho) || to == low || to == high) return to;
    rho = to;
  }
  return rho;
}

struct Dahl : bristle::Run<Dahl> {
  static bristle::Batch batch(const double *p) { return {0, p[kMuC], p[kMuC], 1, 2, p[kSigma0], 0, bristle::kConstant, 1, 0}; }
  static constexpr dfm::plugin::Check check = nullptr;
  static constexpr decltype(dfm_friction::prepare) prepare = nullptr;
  static constexpr decltype(dfm_friction::release) release = nullptr;

  static constexpr bool kFlat = true;
  DEFORM_PASS static bool flow(const double *params, const bristle::Batch &p, bristle::Block &b) {
    if (params[kAlpha] == 1.0) return false;
    for (uint32_t i = 0; i < bristle::kLanes; ++i) b.m[i] = b.w[i], b.mx[i] = b.ex[i], b.my[i] = b.ey[i], b.mn[i] = 0.0, bend(params[kAlpha], p, b, i);
    return true;
  }

  // m = w c(1 - kappa rho), so dm = c dw - w c' (kappa drho + rho dkappa), and from the return
  //   (1 + p f') drho = drho_t - f dp + p rho^2 c' dkappa,   drho_t - f dp = (h K0/F_C) (t - f v^) . dv + (K0 t.dz0 - rho dF_C)/F_C
  static void bend(double a, const bristle::Batch &batch, bristle::Block &b, uint32_t i) {
    const double hk = batch.h * b.k0[i], w = b.w[i], g = b.g[i], tx = b.zx[i] + batch.h * b.vx[i], ty = b.zy[i] + batch.h * b.vy[i];
    const double r = std::sqrt(tx * tx + ty * ty), ex = b.ex[i], ey = b.ey[i];
    if (!(g > 0 && w > 0 && b.k0[i] * r > 1e-100 * g)) return;   // too little bent for the exponent to be felt
    const double ux = tx / r, uy = ty / r, by_level = 1 / g;
    const Trial t = trial_of(hk * w * by_level, b.k0[i] * r * by_level, ux * ex + uy * ey, b.k0[i] * b.zx[i] * by_level, b.k0[i] * b.zy[i] * by_level, ex, ey);
    const double rho = share_of(t, a);
    const Residual at = residual(t, rho, a);
    const double by_sum = 1 / (1 + t.p * at.c.power), bends = t.p * rho * rho * at.c.slope, falls = w * at.c.slope, hr = batch.h / r;
    const double kx = hr * (t.aside * ux - t.lx) + (t.lx + t.aside * ex) / w, ky = hr * (t.aside * uy - t.ly) + (t.ly + t.aside * ey) / w;
    const double rx = by_sum * (hk * by_level * (t.lx + at.lack * ex) + bends * kx), ry = by_sum * (hk * by_level * (t.ly + at.lack * ey) + bends * ky);
    const double ox = b.cut[i] * b.zx[i], oy = b.cut[i] * b.zy[i], along = ux * ox + uy * oy;
    const double kn = (ex * (ox - along * ux) + ey * (oy - along * uy)) / r, rn = by_sum * ((b.k0[i] * along - rho * b.mu[i]) * by_level + bends * kn);
    b.m[i] = w * at.c.value;
    b.mx[i] = at.c.value * ex - falls * (t.kappa * rx + rho * kx);
    b.my[i] = at.c.value * ey - falls * (t.kappa * ry + rho * ky);
    b.mn[i] = -falls * (t.kappa * rn + rho * kn);
  }
};

const dfm_friction law = bristle::ops<Dahl>();
const char *const effects[] = {"presliding", "hysteresis", nullptr};
const dfm_type dahl = dfm::plugin::type(DFM_KIND_FRICTION, "org.deform.dahl", "Dahl friction: a bristle that yields, rate-independent", "0.1.0", "MIT",
                                        "Dahl 1968, 1976; Zerbato 2010, (5.8)-(5.9) corrected: sigma in both terms, signed power; vector form", kRows, effects,
                                        &law);

}  // namespace

DFM_PLUGIN(&dahl)
