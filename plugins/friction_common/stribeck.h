// Set-valued friction with a Stribeck curve, shared by the laws coulomb and karnopp.
//
//   g(w) = F_C + (F_S - F_C) exp(-(w/v_s)^delta), F_C = mu_C fn, F_S = mu_S fn, w = |v|  (Stribeck curve, N)
//   stick  |ft_stop| <= R:  ft = ft_stop, the force that makes the slip of this step zero
//   slip   otherwise:       at rest (w <= band)  F_S along ft_stop, which is where the contact
//                           is about to go;
//                           beyond it            ft = -(g(w) + sigma2 A w) v/w
//
// The laws differ in the band that counts as rest and in the disc that holds what slides already. Coulomb:
// band 0 and R = F_S at every speed. Karnopp: band dv, and beyond it R = g(w) + sigma2 A w: what slides is
// stopped by kinetic friction alone. Where w > band,
//   dft/dv = -[F' v^v^T + (F/w) (1 - v^v^T)],  F = g + sigma2 A w,  F' = g' + sigma2 A,  dft/dfn = -(g/fn) v^
// A lane with a NaN or an infinite input gives NaN in that lane alone. Each lane runs the same operations at
// every vector width.
#pragma once
#include "curve.h"
#include "without.h"

namespace stribeck {

enum { kMuC, kMuS, kVs, kDelta, kSigma2, kShared };  // every law of the family begins with these parameters
constexpr dfm_param kRows[kShared] = {
    CURVE_ROWS,
    dfm::plugin::param("sigma2", "viscous friction per area", "N s/m^3", 0, 1e12, 0, DFM_PARAM_RUNTIME),
};

using lanes::kLanes;
constexpr double kTiny = 1e-280, kHuge = 1e280;  // squares of values beyond these underflow or overflow
// m/s; below it 1/w is constant, so that no derivative is infinite
constexpr double kRest = 1e-100;

// kinetic_stop: a sliding contact is stopped by g(w) + sigma2 A w alone (Karnopp), not by F_S.
struct Batch {
  double mu_c, mu_s, v_s, delta, sigma2, band;
  bool kinetic_stop;
};

// Columns of eight contacts. An unwanted output goes to a separate spare place, so that no two overlap.
struct Block {
  const double *fn, *vx, *vy, *sx, *sy, *area;
  double *fx, *fy, *limit, *xx, *xy, *yx, *yy, *nx, *ny;
};

// Intermediate values of a block: mode 0 open, 1 stick, 2 slip; odd: left to odd_lane; speed and its inverse;
// excess s = exp(-a), a = (w/v_s)^delta, the share of F_S - F_C at this speed, and slope = w s'(w) = -delta a
// s.
struct Passes {
  double mode[kLanes], odd[kLanes], w[kLanes], inverse[kLanes], excess[kLanes], slope[kLanes];
};

// If squares leave the range of doubles, or slip begins from the band of rest: rare, so one lane at a time,
// scaled by the larger component.
struct Polar { double length, x, y; };

inline Polar polar(double x, double y) {
  const double m = std::fabs(x) > std::fabs(y) ? std::fabs(x) : std::fabs(y);
  if (!(m > 0)) return {m, 0, 0};
  const double u = x / m, v = y / m, r = std::sqrt(u * u + v * v);
  return {m * r, u / r, v / r};
}

inline void odd_lane(const Batch &p, const Block &b, Passes &t, uint32_t i) {
  const double fn = b.fn[i], drag = p.sigma2 * b.area[i], stiction = p.mu_s * fn;
  const double nan_flag =
      0.0 * fn + 0.0 * b.vx[i] + 0.0 * b.vy[i] + 0.0 * b.sx[i] + 0.0 * b.sy[i] + 0.0 * drag;
  const Polar stop = polar(b.sx[i], b.sy[i]), v = polar(b.vx[i], b.vy[i]);
  const double w = v.length > p.band ? v.length : 0.0;
  const double x = w / p.v_s;
  const double a = p.delta == 2.0 ? x * x : dfm_pow(x, p.delta);
  const double s = dfm_exp(-a);
  const double slope = s > 0 ? -p.delta * a * s : 0.0;
  const double mu = p.mu_c + (p.mu_s - p.mu_c) * s, level = mu * fn + drag * w;
  double fx = b.sx[i];
  double fy = b.sy[i];
  double limit = p.kinetic_stop && w > 0 ? level : stiction;
  double nx = 0;
  double ny = 0;
  double xx = 0;
  double xy = 0;
  double yy = 0;
  t.mode[i] = 1;
  if (stop.length > limit) {
    const double dx = w > 0 ? -v.x : stop.x, dy = w > 0 ? -v.y : stop.y;
    limit = level;
    fx = limit * dx;
    fy = limit * dy;
    nx = mu * dx;
    ny = mu * dy;
    t.mode[i] = 2;
    if (w > 0) {
      const double divisor = w > kRest ? w : kRest, across = limit / divisor;
      const double d = ((p.mu_s - p.mu_c) * fn * slope + drag * w) / divisor - across;
      xx = -(across + d * dx * dx);
      xy = -(d * dx * dy);
      yy = -(across + d * dy * dy);
    }
  }
  b.fx[i] = fx + nan_flag;
  b.fy[i] = fy + nan_flag;
  b.limit[i] = limit + nan_flag;
  b.nx[i] = nx + nan_flag;
  b.ny[i] = ny + nan_flag;
  b.xx[i] = xx + nan_flag;
  b.xy[i] = b.yx[i] = xy + nan_flag;
  b.yy[i] = yy + nan_flag;
}

// The passes below select values instead of branching: real batches mix stick and slip, and a mispredicted
// branch costs more than computing both sides. Returns whether any lane slips; with kinetic_stop these are
// the lanes beyond the band, and forces() finds those that stop.
struct Found { bool slips, odd; };
template <bool kKineticStop>
DEFORM_PASS inline Found decide(const Batch &p, const Block &b, Passes &t) {
  uint64_t slips = 0, odd = 0;
  const double band2 = p.band * p.band;
  EACH_LANE (i) {
    const double stiction = p.mu_s * b.fn[i];
    const double s2 = b.sx[i] * b.sx[i] + b.sy[i] * b.sy[i];
    const double f2 = stiction * stiction;
    const double v2 = b.vx[i] * b.vx[i] + b.vy[i] * b.vy[i];
    const double larger = s2 > f2 ? s2 : f2;
    const double touches = b.fn[i] > 0 ? 1.0 : 0.0;
    const double gives = s2 > f2 ? touches : 0.0;
    const double moves = v2 > band2 ? touches : 0.0, slip = kKineticStop ? moves : gives;
    const double starts = kKineticStop ? gives * (1.0 - moves) : 0.0;
    const double low = larger < kTiny ? touches : 0.0, high = larger > kHuge ? touches : 0.0;
    const double slow = v2 > kTiny ? 0.0 : slip, fast = v2 < kHuge ? 0.0 : slip;
    t.mode[i] = touches + slip;
    t.odd[i] = ((low + high) + (slow + fast)) + starts;
    slips |= slip > 0 ? uint64_t(1) : uint64_t(0);
    odd |= t.odd[i] > 0 ? uint64_t(1) : uint64_t(0);
    t.w[i] = std::sqrt(slip > 0 ? v2 : 1.0);
    t.inverse[i] = 1.0 / t.w[i];
    t.excess[i] = t.slope[i] = 0.0;
  }
  return {slips != 0, odd != 0};
}

template <bool kKineticStop>
DEFORM_PASS inline void forces(const Batch &p, const Block &b, Passes &t, double *__restrict ofx,
                               double *__restrict ofy, double *__restrict olimit, double *__restrict oxx,
                               double *__restrict oxy, double *__restrict oyx, double *__restrict oyy,
                               double *__restrict onx, double *__restrict ony) {
  EACH_LANE (i) {
    const double fn = b.fn[i];
    const double drag = p.sigma2 * b.area[i];
    const double vx = b.vx[i];
    const double vy = b.vy[i];
    const double sx = b.sx[i];
    const double sy = b.sy[i];
    // 0 where every input is finite, NaN otherwise: no output of a bad lane passes for a good one.
    const double nan_flag = 0.0 * fn + 0.0 * vx + 0.0 * vy + 0.0 * sx + 0.0 * sy + 0.0 * drag;
    const double load = fn > 0 ? fn : 0.0;
    const double mu = p.mu_c + (p.mu_s - p.mu_c) * t.excess[i];
    const double w = t.w[i];
    const double inverse = t.inverse[i];
    const double level = mu * load + drag * w;
    const double mode = t.mode[i];
    const double moves = mode > 1 ? 1.0 : 0.0;
    const double stops = kKineticStop && sx * sx + sy * sy <= level * level ? moves : 0.0;
    const double slip = moves - stops;
    // Lanes without slip use the same operations with zero direction and zero level.
    const double fs = slip > 0 ? level : 0.0, ux = slip > 0 ? vx : 0.0, uy = slip > 0 ? vy : 0.0;
    const double hold = mode - moves - slip;
    const double hx = hold > 0 ? sx : 0.0;
    const double hy = hold > 0 ? sy : 0.0;
    const double stiction = p.mu_s * load;
    const double dx = -ux * inverse, dy = -uy * inverse, across = fs * inverse;
    const double along = ((p.mu_s - p.mu_c) * load * t.slope[i] + drag * w) * inverse;
    const double d = along - across;
    const double xy = -(d * dx * dy) + nan_flag;
    ofx[i] = (fs * dx + hx) + nan_flag;
    ofy[i] = (fs * dy + hy) + nan_flag;
    olimit[i] = (moves > 0 ? level : stiction) + nan_flag;
    onx[i] = mu * dx + nan_flag;
    ony[i] = mu * dy + nan_flag;
    oxx[i] = nan_flag - (across + d * dx * dx);
    oxy[i] = xy;
    oyx[i] = xy;
    oyy[i] = nan_flag - (across + d * dy * dy);
    if (kKineticStop) t.mode[i] = mode - stops;
  }
}

// A law defines Law::kKineticStop, and Law::band(params), which is used if it is above zero.
template <class Law>
struct Run {
  DEFORM_PASS static dfm_status run(const dfm_friction_in *in, dfm_friction_out *out) {
    const double *const v = in->params;
    const Batch p = {v[kMuC], v[kMuS], v[kVs], v[kDelta], v[kSigma2], Law::band(v), Law::kKineticStop};
    const size_t stride = in->stride;
    double spare[9][kLanes];
    for (size_t at = 0; at < in->n; at += kLanes) {  // lanes up to n rounded to 8 may be touched
      const auto to = [&](double *column, size_t c, uint32_t k) {
        return column ? column + c * stride + at : spare[k];
      };
      const Block b = {in->fn + at,
                       in->vt + at,
                       in->vt + stride + at,
                       in->ft_stop + at,
                       in->ft_stop + stride + at,
                       in->area + at,
                       to(out->ft, 0, 0),
                       to(out->ft, 1, 1),
                       to(out->limit, 0, 2),
                       to(out->dft_dvt, 0, 3),
                       to(out->dft_dvt, 1, 4),
                       to(out->dft_dvt, 2, 5),
                       to(out->dft_dvt, 3, 6),
                       to(out->dft_dfn, 0, 7),
                       to(out->dft_dfn, 1, 8)};
      Passes t;
      const Found found = decide<Law::kKineticStop>(p, b, t);
      if (found.slips && p.mu_s != p.mu_c) lanes::curve(p.v_s, p.delta, t.w, t.excess, t.slope);
      forces<Law::kKineticStop>(p, b, t, b.fx, b.fy, b.limit, b.xx, b.xy, b.yx, b.yy, b.nx, b.ny);
      for (uint32_t i = 0; found.odd && i < kLanes; ++i)
        if (t.odd[i] > 0) odd_lane(p, b, t, i);
      if (out->mode)
        for (uint32_t i = 0; i < kLanes; ++i) out->mode[at + i] = static_cast<uint8_t>(t.mode[i]);
      if (out->stored)
        for (uint32_t i = 0; i < kLanes; ++i) out->stored[at + i] = 0;
    }
    return DFM_OK;
  }
};

constexpr uint32_t kNeeds = DFM_NEED_FN | DFM_NEED_VT | DFM_NEED_FT_STOP | DFM_NEED_AREA;
constexpr uint32_t kFlags = DFM_FRIC_SET_VALUED | DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_JACOBIAN;

constexpr dfm_friction ops(dfm::plugin::Eval eval) {
  dfm_friction f = dfm::plugin::friction(kNeeds, kFlags, eval, lanes::check);
  f.without = without::level<kMuC, kMuS, kSigma2>;
  return f;
}

}  // namespace stribeck
