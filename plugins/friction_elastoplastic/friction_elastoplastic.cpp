// Elasto-plastic friction: LuGre with an elastic zone, so that what stays below the elastic limit comes back.
// Dupont, Hayward, Armstrong, Altpeter 2002, (7)-(12); Zerbato 2010, (5.16)-(5.17) corrected: |z| in the
// sine, no flow while unloading, z_max and F_s the steady level g(w), odd power signed.
//
//   dz/dt = v - (K0 m/g) z,   m = M e,   rho = K0 |z|/g,   f = rho e = 1 - q |q|^(i-1),   q = 1 - alpha rho
//   alpha = 0 below rho = lambda = kappa F_C/g, 1 from rho = 1, sin^2(pi u/2) between, u = (rho -
//   lambda)/(1 - lambda)
//
// In one dimension this is dz/dt = v |q|^i sgn q while z v > 0, v otherwise. In the plane the multiplier M
// says how much of the slip loads the bristle: associated M = max(0, z^.v), the radial return of plasticity;
// cosine M = w (1 + cos(z, v))/2. The implicit step of bristle.h lies along the trial direction t, with P = h
// K0 M/g and rho_t = K0 |zt|/g:
//
//   rho + P f(rho) = rho_t      one root, since f' >= 0; Newton in a bracket, eight lanes at a time; a lane
//                               that has converged stays as it is
//   (1 + P f') drho = (h K0/g) (t.dv - f dM) - rho dg/g - P f_lambda dlambda (+ K0 t.dz0/g),
//   dlambda = -lambda dg/g at constant fn
//
// Where g has fallen with speed below what the bristle holds (rho > 1), q = 1 - rho < 0 and the plastic rate
// is m = M (1 + (rho - 1)^i)/rho: more than w for i > 1 and rho > 2. It, and not w, is what the micro-damping
// must not outrun, so bristle.h damps at max(w, m).
#include "../friction_common/lugre_rows.h"

namespace {

using bristle::Block;
using bristle::kLanes;

enum { kKappa = lugre::kShared, kI, kMultiplier };
enum Multiplier { kAssociated, kCosine };
constexpr const char *kMultipliers[] = {"associated", "cosine", nullptr};
constexpr dfm_param kRows[] = {
    LUGRE_ROWS,
    dfm::plugin::param("kappa", "elastic limit sigma0 z_ba as a share of F_C", "1", 1e-3, 0.999, 0.7,
                       DFM_PARAM_RUNTIME),
    dfm::plugin::param("i", "exponent of the yield", "1", 1, 8, 1, DFM_PARAM_INTEGER | DFM_PARAM_RUNTIME),
    dfm::plugin::enumeration("multiplier", "what part of the slip loads the bristle", kMultipliers,
                             kAssociated),
};

// The return of eight lanes. rest = rho_t - P, taken from the old bristle because a long step makes both
// large and nearly equal.
struct Return {
  double tx[kLanes], ty[kLanes], by_r[kLanes], load[kLanes], mult[kLanes], p[kLanes], top[kLanes],
      rest[kLanes], lambda[kLanes], rho[kLanes];
};

// f and its slopes by rho and lambda; left = 1 - f.
struct Yield { double f, left, slope, by_lambda; };

// The exponent i as what chooses among the powers of q, so that no lane loops: takes[k] = 1 where q^k is in 1
// + q + ... + q^(i-1), and the bits of i - 1.
struct Exponent {
  double i, takes[8], one, two, four;
  DEFORM_PASS explicit Exponent(int n)
      : i(n), one((n - 1) & 1), two((n - 1) >> 1 & 1), four((n - 1) >> 2 & 1) {
    for (int k = 0; k < 8; ++k) takes[k] = k < n ? 1.0 : 0.0;
  }
};

// kPlain: i = 1.
template <bool kPlain>
DEFORM_PASS inline Yield yield(double rho, double lambda, const Exponent &e) {
  const double width = 1.0 / (1.0 - lambda);
  const double u = (rho - lambda) * width;
  const double half = 0.5 * (u > 0 ? (u < 1 ? u : 1.0) : 0.0);
  double s, c;
  dfm_sincospi_(half, &s, &c);
  const double inside = u > 0 && u < 1 ? 0x1.921fb54442d18p+1 : 0.0;
  const double alpha = u < 1 ? s * s : 1.0;
  const double by_u = inside * s * c;
  const double q = 1.0 - alpha * rho;
  const double size = std::fabs(q), q2 = q * q, q4 = q2 * q2;
  const double power =
      kPlain ? 1.0
             : (e.one * size + (1.0 - e.one)) * (e.two * q2 + (1.0 - e.two)) * (e.four * q4 + (1.0 - e.four));
  const double steep = kPlain ? 1.0 : e.i * power, bend = steep * rho * by_u * width, left = q * power;
  // 1 - q^i = (1 - q)(1 + q + ...): avoids a difference when little yields
  const double *const n = e.takes;
  const double sum =
      1.0 + q * (n[1] + q * (n[2] + q * (n[3] + q * (n[4] + q * (n[5] + q * (n[6] + q * n[7]))))));
  const double f = kPlain ? alpha * rho : q >= 0 ? alpha * rho * sum : 1.0 - left;
  return {f, left, steep * alpha + bend, -bend * (1.0 - u)};
}

DEFORM_PASS inline void trial(const bristle::Batch &p, const Block &b, double kappa, int multiplier,
                              Return &t) {
  EACH_LANE (i) {
    const double zx = b.zx[i] + p.h * b.vx[i];
    const double zy = b.zy[i] + p.h * b.vy[i];
    const double square = zx * zx + zy * zy;
    const double some = square > 1e-290 ? 1.0 : 0.0;
    const double r = std::sqrt(some > 0 ? square : 1.0), by_r = some / r;
    const double tx = zx * by_r;
    const double ty = zy * by_r;
    const double load = tx * b.vx[i] + ty * b.vy[i];
    const double forward = load > 0 ? load : 0.0;
    const double level = b.g[i] > 1e-30 * b.fn[i] ? b.g[i] : 1.0;
    const double k = b.k0[i] / level;
    const double ux = k * b.zx[i];
    const double uy = k * b.zy[i];
    const double n = ux * ux + uy * uy;
    const double s = ux * b.ex[i] + uy * b.ey[i];
    const double along = p.h * k * b.w[i];
    const double top = k * r * some;
    const double by_top = 1.0 / (top > 1e-200 ? top : 1e-200);
    const double beside = (n + along * s) * by_top;
    const double beyond = (n + 2.0 * along * s) / (top + along + 1e-200);
    // rho_t less h K0 w/g, and less h K0 (t.v)/g; where the slip unloads, P = 0
    t.tx[i] = tx;
    t.ty[i] = ty;
    t.by_r[i] = by_r;
    t.load[i] = load;
    t.top[i] = top;
    const double both = 0.5 * (b.w[i] + load);  // may round below 0 if slip and bristle are exactly opposed
    t.mult[i] = multiplier == kCosine ? (both > 0 ? both : 0.0) : forward;
    t.p[i] = p.h * k * t.mult[i];
    t.rest[i] = multiplier == kCosine ? 0.5 * (beyond + beside) : load > 0 ? beside : top;
    const double limit = kappa * p.mu_c / (b.mu[i] > 1e-30 ? b.mu[i] : 1e-30);
    t.lambda[i] = limit < 0.9999 ? limit : 0.9999;
  }
}

// 1 if a lane yields, else 0.
DEFORM_PASS inline bool yields(const Return &t, double *active) {
  uint64_t some = 0;
  EACH_LANE (k) {
    active[k] = t.top[k] > t.lambda[k] && t.p[k] > 0 ? 1.0 : 0.0;
    some |= active[k] > 0 ? uint64_t(1) : uint64_t(0);
  }
  return some != 0;
}

// No lane yields: the result of rates() for f = 0 or M = 0, by the associated multiplier.
DEFORM_PASS inline void hold(Block &b) {
  EACH_LANE (k) {
    const double plastic = b.g[k] > 1e-30 * b.fn[k] ? 1.0 : 0.0;
    b.m[k] = plastic > 0 ? 0.0 : b.w[k];
    b.mx[k] = plastic > 0 ? 0.0 : b.ex[k];
    b.my[k] = plastic > 0 ? 0.0 : b.ey[k];
    b.mn[k] = 0.0;
  }
}

// Newton's steps within a bracket, which is halved where they do not shrink by half in two passes: f has an
// inflection where i > 1, about which they may go to and fro.
template <bool kPlain>
DEFORM_PASS inline void solve(Return &t, double *active, const Exponent &e) {
  double low[kLanes], high[kLanes], last[kLanes], before[kLanes], flows = 1;
  EACH_LANE (k) {
    const double lambda = t.lambda[k];
    const double elastic = t.top[k] < lambda ? t.top[k] : lambda;
    const double full = t.top[k] / (1.0 + t.p[k]);
    low[k] = elastic;
    high[k] = full < 1.0 && t.top[k] > 1.0 ? 1.0 : t.top[k];
    // f <= rho where i = 1, so the root lies above full, which it meets at the level; else from above for a
    // short step, from the steepest part for a long one
    const double middle = lambda + 0.6 * (1.0 - lambda);
    const double start = full >= 1.0 ? full : t.p[k] < 0.3 ? high[k] : full > middle ? full : middle;
    t.rho[k] = start > low[k] ? (start < high[k] ? start : high[k]) : low[k];
    t.rho[k] = active[k] > 0 ? t.rho[k] : t.top[k];
    last[k] = before[k] = 1e300;
  }
  for (int pass = 0; pass < 100 && flows > 0; ++pass) {
    flows = 0;
    EACH_LANE (k) {
      const double rho = t.rho[k];
      const Yield y = yield<kPlain>(rho, t.lambda[k], e);
      const double far = (rho - t.rest[k]) - t.p[k] * y.left;
      const double near = (rho - t.top[k]) + t.p[k] * y.f;
      const double excess = y.f > 0.5 ? far : near;
      const double up = excess > 0 ? rho : high[k];
      const double down = excess > 0 ? low[k] : rho;
      const double next = rho - excess / (1.0 + t.p[k] * y.slope);
      const bool shrinks = kPlain || std::fabs(next - rho) <= 0.5 * before[k];
      const double to = next >= down && next <= up && shrinks ? next : 0.5 * (down + up);
      const double moved = std::fabs(to - rho);
      high[k] = active[k] > 0 ? up : high[k];
      low[k] = active[k] > 0 ? down : low[k];
      t.rho[k] = active[k] > 0 ? to : rho;
      before[k] = last[k];
      last[k] = moved;
      active[k] = moved > 4e-16 * rho ? active[k] : 0.0;
    }
    EACH_LANE (k) flows += active[k];
  }
}

// m and its derivatives:  m = (M/rho) f,  dm = (f/rho) dM + (M/rho) [(f' - f/rho) drho + f_lambda dlambda].
template <bool kPlain>
DEFORM_PASS inline void rates(const bristle::Batch &p, const Exponent &exponent, int multiplier,
                              const Return &t, Block &b) {
  const double whole = multiplier == kCosine ? 0.5 : 0.0;
  // no selection by `multiplier` in the loop; otherwise the compiler would not vectorize
  EACH_LANE (k) {
    const double plastic = b.g[k] > 1e-30 * b.fn[k] ? 1.0 : 0.0;
    const double level = plastic > 0 ? b.g[k] : 1.0;
    const double by_level = 1.0 / level;
    const double hk = p.h * b.k0[k] * by_level;
    const double rho = t.rho[k];
    const double by_rho = 1.0 / (rho > 1e-100 ? rho : 1e-100);
    const double mult = t.mult[k];
    const double load = t.load[k];
    const double tx = t.tx[k];
    const double ty = t.ty[k];
    const Yield y = yield<kPlain>(rho, t.lambda[k], exponent);
    // dM: of t.v, and of w where the multiplier is the cosine
    const double turn = p.h * t.by_r[k];
    const double lx = tx + turn * (b.vx[k] - load * tx);
    const double ly = ty + turn * (b.vy[k] - load * ty);
    const double ox = b.cut[k] * b.zx[k], oy = b.cut[k] * b.zy[k], along = tx * ox + ty * oy;
    const double ln = t.by_r[k] * ((ox - along * tx) * b.vx[k] + (oy - along * ty) * b.vy[k]);
    const double on = whole + (1.0 - 2.0 * whole) * (mult > 0 ? 1.0 : 0.0);
    const double dx = whole * b.ex[k] + on * lx, dy = whole * b.ey[k] + on * ly, dn = on * ln;
    const double fx = b.fall[k] * b.by_w[k] * by_level * b.ex[k];
    const double fy = b.fall[k] * b.by_w[k] * by_level * b.ey[k];  // dg/g
    const double by_sum = 1.0 / (1.0 + t.p[k] * y.slope);
    const double lambda = t.lambda[k];
    const double pl = t.p[k] * y.by_lambda * lambda;
    const double rx = by_sum * (hk * (tx - y.f * dx) + (pl - rho) * fx);
    const double ry = by_sum * (hk * (ty - y.f * dy) + (pl - rho) * fy);
    const double rn = by_sum * (b.k0[k] * by_level * along - hk * y.f * dn - rho * b.mu[k] * by_level);
    const double e = y.f * by_rho;
    const double share = mult * by_rho;
    const double bend = share * (y.slope - e);
    const double part = -share * y.by_lambda * lambda;
    b.m[k] = plastic > 0 ? mult * e : b.w[k];
    b.mx[k] = plastic > 0 ? e * dx + bend * rx + part * fx : b.ex[k];
    b.my[k] = plastic > 0 ? e * dy + bend * ry + part * fy : b.ey[k];
    b.mn[k] = plastic > 0 ? e * dn + bend * rn : 0.0;
  }
}

struct Elastoplastic : bristle::Run<Elastoplastic> {
  static bristle::Batch batch(const double *p) { return lugre::batch(p); }
  static constexpr bool kFlat = false;
  DEFORM_PASS static bool flow(const double *params, const bristle::Batch &p, Block &b) {
    const int i = static_cast<int>(params[kI]), multiplier = static_cast<int>(params[kMultiplier]);
    const Exponent e(i);
    Return t;
    trial(p, b, params[kKappa], multiplier, t);
    double active[kLanes];
    const bool flows = yields(t, active);
    if (!flows && multiplier == kAssociated) {
      hold(b);
    } else if (i == 1) {
      solve<true>(t, active, e);
      rates<true>(p, e, multiplier, t, b);
    } else {
      solve<false>(t, active, e);
      rates<false>(p, e, multiplier, t, b);
    }
    return true;
  }
  static constexpr auto check = lanes::check;
  // The flow is 1 + (rho - 1)^i beyond the cone, which a falling level leaves at rho = mu_S/mu_C: with i > 1
  // that is more than LuGre's rho above 2.
  static dfm_status prepare(const dfm_host *host, const double *params, void **data) {
    *data = nullptr;
    const double level = params[lugre::kMuC], drop = params[lugre::kMuS] - level;
    double power = drop;  // mu_C (rho - 1)^i; at a level of 0, where rho has no bound, LuGre's
    for (int k = 1; level > 0 && k < static_cast<int>(params[kI]); ++k) power *= drop / level;
    const bool steep = power > drop;
    lugre::warn(host, params, params[lugre::kSigma1] * (steep ? power : drop),
                steep ? "mu_C (mu_S/mu_C - 1)^i" : "(mu_S - mu_C)");
    return DFM_OK;
  }
  static constexpr auto release = lugre::release;
};

const dfm_friction law = lugre::ops<Elastoplastic>();
const char *const effects[] = {"stiction",   "stribeck",  "viscous", "presliding",
                               "hysteresis", "breakaway", nullptr};
const dfm_type elastoplastic = dfm::plugin::type(
    DFM_KIND_FRICTION, "org.deform.elastoplastic", "Elasto-plastic friction: LuGre with an elastic zone",
    "0.1.0", "MIT", "Dupont, Hayward, Armstrong, Altpeter 2002, (7)-(12); associated vector form", kRows,
    effects, &law);

}  // namespace

DFM_PLUGIN(&elastoplastic)
