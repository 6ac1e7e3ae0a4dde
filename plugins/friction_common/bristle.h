// Laws whose memory is one elastic bristle per contact: dahl, lugre, elastoplastic. One idea behind them: the
// tangential displacement is an elastic part z, kept as a vector in the tangent plane, and a plastic rest
// that flows against it at the rate m (m/s) that the law chooses,
//
//   dz/dt = v - (K0 m / g) z,   F = K0 z + K1 dz/dt + K2 v,   ft = -F,
//   K0 = sigma0 A, K1 = sigma1 A, K2 = sigma2 A
//
// g(w) the Stribeck level (N), w = |v|. LuGre and Dahl: m = w (Canudas de Wit et al. 1995, (1)-(3); Dahl
// 1976); elastoplastic: m = alpha M. One step of length h is an implicit radial return at the new slip and
// the new normal force (doc/laws/formulas.md (7), (8)), after the old bristle has been brought into the new
// cone, z0 = z min(1, F_S / |K0 z|), which only lowers the stored energy K0 |z|^2 / 2:
//
//   zt = z0 + h v,   D = g + h K0 m,   z' = zt g/D,   dz/dt = (g v - K0 m z0)/D
//
// Nothing divides by w, fn or h, so rest, open contacts and h = 0 are points like any other. With the total
// derivatives dm/dv and dm/dfn,
//
//   dz'/dv  = h [ (g/D) 1 - (K0/D^2) zt (g dm/dv - m dg/dv)^T ]
//   dz'/dfn = (g/D) dz0/dfn + (h K0/D^2) zt (m dg/dfn - g dm/dfn),
//   dz0/dfn = z0/fn where the old bristle was cut, else 0
//
// and those of dz/dt are the same over h less dz0. Any m >= 0 is dissipative: V = K0 |z|^2/2 gives (K0 z).v -
// V' = K0 m K0 |z|^2/g. The micro-damping is passive for every y = K0 z iff K1^2 m <= 4 g (K1 + K2). So it is
// damped at the speed W = max(w, m), which is w where m <= w: the default K1e = K1 / (1 + K1 W/(4 g)) has K1e
// m <= 4 g whatever the parameters. The step inherits that, with d = z' - z0 and y = K0 z':
//
//   F.v h - dV = (K0/2 + K1e/h) d^2 + h (m/g) y^2 + K1e (m/g) d.y + K2 w^2 h  >=  0
//   where (K1e m/g)^2 <= 4 (K1e/h) (h m/g),  the same bound
#pragma once
#include "curve.h"

namespace bristle {

using lanes::kLanes;
using lanes::within;

enum Form { kPassive, kConstant, kFalling };

// mu_s = mu_c: no Stribeck curve. sigma1 = 0: no micro-damping.
struct Batch {
  double h, mu_c, mu_s, v_s, delta, sigma0, sigma1;
  int form;
  double v_d, sigma2;
};

// N: smaller normal forces count as zero; the square of larger ones overflows
constexpr double kMin = 1e-140, kMax = 1e140;
constexpr double kFar = 1e100;  // m/s and m: larger values are clamped to this
constexpr double kWide = 1e20;  // m^2

// Intermediate values of a block of eight contacts.
struct Block {
  double nan_flag[kLanes], fn[kLanes], k0[kLanes], k1[kLanes], k2[kLanes];
  // by_w = 1/w, constant below 1e-140 m/s
  double vx[kLanes], vy[kLanes], w[kLanes], by_w[kLanes];
  // z0, and 1/fn if the cone has shortened the old bristle, else 0
  double zx[kLanes], zy[kLanes], cut[kLanes];
  double mu[kLanes], g[kLanes], fall[kLanes];  // g = mu fn, fall = w g'(w)
  double ex[kLanes], ey[kLanes];               // v/w, 0 at rest
  // plastic rate and its total derivatives by v and fn
  double m[kLanes], mx[kLanes], my[kLanes], mn[kLanes];
};

// Output columns of eight contacts; an unwanted column goes to a separate spare place, so that no two
// overlap.
enum Column { kFx, kFy, kZx, kZy, kXx, kXy, kYx, kYy, kNx, kNy, kLimit, kStored, kColumns };
struct Columns {
  double *first[kColumns], spare[kColumns][kLanes];
  size_t follows[kColumns];  // all ones: a column of the batch; 0: the spare place
  DEFORM_PASS Columns(dfm_friction_out *out, size_t stride) {
    const auto place = [&](uint32_t at, double *base, uint32_t n) DEFORM_PASS {
      for (uint32_t c = 0; c < n; ++c) {
        first[at + c] = base ? base + c * stride : spare[at + c];
        follows[at + c] = base ? ~size_t(0) : 0;
      }
    };
    place(kFx, out->ft, 2);
    place(kZx, out->state, 2);
    place(kXx, out->dft_dvt, 4);
    place(kNx, out->dft_dfn, 2);
    place(kLimit, out->limit, 1);
    place(kStored, out->stored, 1);
  }
  DEFORM_PASS double *to(Column c, size_t at) const { return first[c] + (at & follows[c]); }
};

// Whether all eight are within the range of the passes; false if an input is NaN.
DEFORM_PASS inline bool is_finite(const dfm_friction_in *in, size_t at) {
  const size_t stride = in->stride;
  const double *const fn = in->fn + at;
  const double *const vx = in->vt + at;
  const double *const vy = vx + stride;
  const double *const zx = in->state + at;
  const double *const zy = zx + stride;
  const double *const area = in->area + at;
  uint64_t odd = 0;
  EACH_LANE (i) {
    const double n = kFar / kMax * fn[i], a = kFar / kWide * area[i];
    const double size = (vx[i] * vx[i] + vy[i] * vy[i]) + (zx[i] * zx[i] + zy[i] * zy[i]) + (n * n + a * a);
    odd |= size < kFar * kFar ? uint64_t(0) : uint64_t(1);
  }
  return odd == 0;
}

// kSound: no value to clamp, no invalid value to pass on.
template <bool kSound, bool kFlat>
DEFORM_PASS inline void load(const Batch &p, const dfm_friction_in *in, size_t at, Block &b) {
  const size_t stride = in->stride;
  const double *const fn = in->fn + at;
  const double *const vx = in->vt + at;
  const double *const vy = vx + stride;
  const double *const zx = in->state + at;
  const double *const zy = zx + stride;
  const double *const area = in->area + at;
  double size2[kLanes], over[kLanes];
  uint64_t cuts = 0;
  EACH_LANE (i) {
    // 0 if every input is finite, else NaN, so that a lane with an invalid input has invalid outputs.
    b.nan_flag[i] =
        kSound ? 0.0
               : ((0.0 * fn[i] + 0.0 * vx[i]) + (0.0 * vy[i] + 0.0 * zx[i])) + (0.0 * zy[i] + 0.0 * area[i]);
    const double touches = fn[i] > kMin ? fn[i] : 0.0;
    const double a = area[i] > 0 ? area[i] : 0.0;
    const double A = kSound || a < kWide ? a : kWide;
    b.fn[i] = kSound || touches < kMax ? touches : kMax;
    b.k0[i] = p.sigma0 * A;
    if (!kFlat) {
      b.k1[i] = p.sigma1 * A;
      b.k2[i] = p.sigma2 * A;
    }
    const double x = kSound ? vx[i] : within(vx[i], kFar);
    const double y = kSound ? vy[i] : within(vy[i], kFar);
    const double square = x * x + y * y;
    const double ux = square > kMin * kMin ? x : 0.0;
    const double uy = square > kMin * kMin ? y : 0.0;
    const double w = std::sqrt(square > kMin * kMin ? square : 0.0);
    const double by_w = 1.0 / (w > kMin ? w : kMin);
    b.vx[i] = ux;
    b.vy[i] = uy;
    b.w[i] = w;
    b.by_w[i] = by_w;
    b.ex[i] = ux * by_w;
    b.ey[i] = uy * by_w;
    const double old_x = kSound ? zx[i] : within(zx[i], kFar), old_y = kSound ? zy[i] : within(zy[i], kFar);
    const double ox = touches > 0 ? old_x : 0.0;
    const double oy = touches > 0 ? old_y : 0.0;
    const double px = b.k0[i] * ox;
    const double py = b.k0[i] * oy;
    const double cone = p.mu_s * b.fn[i];
    b.zx[i] = ox;
    b.zy[i] = oy;
    b.cut[i] = 0.0;
    size2[i] = px * px + py * py;
    over[i] = size2[i] > cone * cone ? 1.0 : 0.0;
    cuts |= size2[i] > cone * cone ? uint64_t(1) : uint64_t(0);
  }
  if (cuts == 0) return;
  EACH_LANE (i) {
    const double cone = p.mu_s * b.fn[i], outside = over[i];
    const double inverse = 1.0 / std::sqrt(outside > 0 ? size2[i] : 1.0);
    const double scale = outside > 0 ? cone * inverse : 1.0;
    b.zx[i] *= scale;
    b.zy[i] *= scale;
    b.cut[i] = outside / (b.fn[i] > 0 ? b.fn[i] : kMax);
  }
}

template <bool kFlat>
DEFORM_PASS inline void level(const Batch &p, Block &b) {
  double excess[kLanes], slope[kLanes];
  if (!kFlat && p.mu_s != p.mu_c) {
    lanes::curve(p.v_s, p.delta, b.w, excess, slope);
    EACH_LANE (i) {
      b.mu[i] = b.fn[i] > 0 ? p.mu_c + (p.mu_s - p.mu_c) * excess[i] : 0.0;
      b.g[i] = b.mu[i] * b.fn[i];
      b.fall[i] = (p.mu_s - p.mu_c) * b.fn[i] * slope[i];
    }
  } else {
    EACH_LANE (i) {
      b.mu[i] = b.fn[i] > 0 ? p.mu_c : 0.0;
      b.g[i] = p.mu_c * b.fn[i];
    }
    if (!kFlat)
      EACH_LANE (i) b.fall[i] = 0.0;
  }
}

// Micro-damping and its derivatives by v and fn.
struct Damping { double k1[kLanes], x[kLanes], y[kLanes], n[kLanes]; };

// kSlips: m = w, so W = w.
template <bool kSlips>
DEFORM_PASS inline void damping(const Batch &p, const Block &b, Damping &d) {
  double W[kLanes], wx[kLanes], wy[kLanes], wn[kLanes];
  EACH_LANE (i) {
    const double w = b.w[i], m = kSlips ? 0.0 : b.m[i] < kFar ? b.m[i] : kFar, faster = m > w ? 1.0 : 0.0;
    W[i] = faster > 0 ? m : w;
    wx[i] = kSlips || !(faster > 0) ? b.ex[i] : b.mx[i];
    wy[i] = kSlips || !(faster > 0) ? b.ey[i] : b.my[i];
    wn[i] = kSlips || !(faster > 0) ? 0.0 : b.mn[i];
  }
  if (p.form == kPassive) {
    EACH_LANE (i) {
      const double level4 = 4.0 * b.g[i];
      const double kw = b.k1[i] * W[i];
      const double sum = level4 + kw;
      const double inverse = 1.0 / (sum > kMin ? sum : kMin);
      // K1e = K1 share; the limit at g = W = 0 has no effect, because there is no contact
      const double share = level4 * inverse, rest = kw * inverse;
      const double by_speed = -(b.k1[i] * share) * (b.k1[i] * inverse);
      const double by_g = 4.0 * b.k1[i] * rest * inverse;
      const double steep = by_g * (b.fall[i] * b.by_w[i]);
      d.k1[i] = b.k1[i] * share;
      d.x[i] = by_speed * wx[i] + steep * b.ex[i];
      d.y[i] = by_speed * wy[i] + steep * b.ey[i];
      d.n[i] = by_speed * wn[i] + by_g * b.mu[i];
    }
  } else if (p.form == kConstant) {
    EACH_LANE (i) {
      d.k1[i] = b.k1[i];
      d.x[i] = d.y[i] = d.n[i] = 0.0;
    }
  } else {
    double s[kLanes], slope[kLanes];
    const double by_vd = 1.0 / p.v_d;
    lanes::curve(p.v_d, 2.0, W, s, slope);
    EACH_LANE (i) {
      const double k = b.k1[i] * s[i], by_speed = -2.0 * k * (W[i] * by_vd) * by_vd;
      d.k1[i] = k;
      d.x[i] = by_speed * wx[i];
      d.y[i] = by_speed * wy[i];
      d.n[i] = by_speed * wn[i];
    }
  }
}

// kDamped: sigma1 > 0; kFlat: g does not depend on the speed, and nothing is viscous; kSlips: every
// motion slips, m = w (Dahl, LuGre). Arguments are pointers that do not overlap; otherwise the compiler would
// not vectorize.
template <bool kDamped, bool kFlat, bool kSlips>
DEFORM_PASS inline void damped_force(const Batch &p, const Block &b, const Damping &d, double *__restrict ofx,
                                     double *__restrict ofy, double *__restrict ozx, double *__restrict ozy,
                                     double *__restrict oxx, double *__restrict oxy, double *__restrict oyx,
                                     double *__restrict oyy, double *__restrict onx, double *__restrict ony,
                                     double *__restrict olimit, double *__restrict ostored,
                                     double *__restrict mode) {
  EACH_LANE (i) {
    const double k0 = b.k0[i];
    const double hk = p.h * k0;
    const double g = b.g[i];
    const double m = kSlips ? b.w[i] : b.m[i];
    const double vx = b.vx[i];
    const double vy = b.vy[i];
    const double z0x = b.zx[i];
    const double z0y = b.zy[i];
    const double sum = g + hk * m;
    const double divisor = sum > kMin * 1e-10 ? sum : kMin * 1e-10;
    const double nan_flag = b.nan_flag[i];
    // q itself: exactly 1 at rest, so that a holding bristle does not decay
    const double q = g / divisor, inverse = 1.0 / divisor;
    const double tx = z0x + p.h * vx, ty = z0y + p.h * vy, zx = tx * q, zy = ty * q;
    // dm and dg times their common factor
    const double mx = kSlips ? b.ex[i] : b.mx[i];
    const double my = kSlips ? b.ey[i] : b.my[i];
    const double by_plastic = kSlips ? 0.0 : q * b.mn[i];
    const double fe = kFlat ? 0.0 : m * inverse * b.fall[i] * b.by_w[i];
    const double gx = kFlat ? q * mx : q * mx - fe * b.ex[i], gy = kFlat ? q * my : q * my - fe * b.ey[i];
    const double cx = k0 * inverse * tx, cy = k0 * inverse * ty;
    // (dz'/dv)/h = d(dz/dt)/dv
    const double xx = q - cx * gx, xy = -(cx * gy), yx = -(cy * gx), yy = q - cy * gy;
    const double pn = m * b.mu[i] * inverse - by_plastic;
    const double ox = b.cut[i] * z0x;
    const double oy = b.cut[i] * z0y;
    const double fade = k0 * m * inverse;
    const double nx = q * ox + p.h * (cx * pn), ny = q * oy + p.h * (cy * pn);
    const double touches = b.fn[i] > 0 ? 1.0 : 0.0;
    const double cone = kFlat ? g : p.mu_s * b.fn[i];
    const double k2 = kFlat ? 0.0 : touches * b.k2[i];
    double fx = kFlat ? k0 * zx : k0 * zx + k2 * vx;
    double fy = kFlat ? k0 * zy : k0 * zy + k2 * vy;
    double fnx = k0 * nx;
    double fny = k0 * ny;
    double most = kFlat ? cone : cone + k2 * b.w[i];
    double dxx = kFlat ? hk * xx : hk * xx + k2;
    double dxy = hk * xy;
    double dyx = hk * yx;
    double dyy = kFlat ? hk * yy : hk * yy + k2;
    if (kDamped) {
      const double k = d.k1[i];
      const double rx = (g * vx - k0 * m * z0x) * inverse;
      const double ry = (g * vy - k0 * m * z0y) * inverse;  // dz/dt
      fx += k * rx;
      fy += k * ry;
      dxx += k * xx + d.x[i] * rx;
      dxy += k * xy + d.y[i] * rx;
      dyx += k * yx + d.x[i] * ry;
      dyy += k * yy + d.y[i] * ry;
      fnx += k * (cx * pn - fade * ox) + d.n[i] * rx;
      fny += k * (cy * pn - fade * oy) + d.n[i] * ry;
      most += k * ((g * b.w[i] + m * cone) * inverse);
    }
    const double trial2 = (k0 * tx) * (k0 * tx) + (k0 * ty) * (k0 * ty);
    mode[i] = touches + touches * (trial2 > g * g ? 1.0 : 0.0);
    ofx[i] = nan_flag - fx;
    ofy[i] = nan_flag - fy;
    ozx[i] = zx + nan_flag;
    ozy[i] = zy + nan_flag;
    oxx[i] = nan_flag - dxx;
    oxy[i] = nan_flag - dxy;
    oyx[i] = nan_flag - dyx;
    oyy[i] = nan_flag - dyy;
    onx[i] = nan_flag - fnx;
    ony[i] = nan_flag - fny;
    olimit[i] = most + nan_flag;
    ostored[i] = 0.5 * (k0 * zx * zx + k0 * zy * zy) + nan_flag;
  }
}

template <bool kDamped, bool kFlat, bool kSlips>
DEFORM_PASS inline void damped_force(const Batch &p, const Block &b, const Damping &d, const Columns &c,
                                     size_t at, double *mode) {
  damped_force<kDamped, kFlat, kSlips>(
      p, b, d, c.to(kFx, at), c.to(kFy, at), c.to(kZx, at), c.to(kZy, at), c.to(kXx, at), c.to(kXy, at),
      c.to(kYx, at), c.to(kYy, at), c.to(kNx, at), c.to(kNy, at), c.to(kLimit, at), c.to(kStored, at), mode);
}

// A law of the family defines Law::batch(params), Law::kFlat, and Law::flow(params, batch, block), which
// computes m and its derivatives, or returns false if every motion slips.
template <class Law>
struct Run {
  DEFORM_PASS static dfm_status run(const dfm_friction_in *in, dfm_friction_out *out) {
    constexpr bool kFlat = Law::kFlat;
    Batch p = Law::batch(in->params);
    p.h = in->dt;
    const Columns to(out, in->stride);
    for (size_t at = 0; at < in->n; at += kLanes) {  // lanes up to n rounded to 8 may be touched
      double mode[kLanes];
      Block b;
      Damping d;
      if (is_finite(in, at)) load<true, kFlat>(p, in, at, b);
      else load<false, kFlat>(p, in, at, b);
      level<kFlat>(p, b);
      const bool fills = Law::flow(in->params, p, b);
      if (!kFlat && p.sigma1 > 0) {
        fills ? damping<false>(p, b, d) : damping<true>(p, b, d);
        fills ? damped_force<true, kFlat, false>(p, b, d, to, at, mode)
              : damped_force<true, kFlat, true>(p, b, d, to, at, mode);
      } else {
        fills ? damped_force<false, kFlat, false>(p, b, d, to, at, mode)
              : damped_force<false, kFlat, true>(p, b, d, to, at, mode);
      }
      if (out->mode)
        for (uint32_t i = 0; i < kLanes; ++i) out->mode[at + i] = static_cast<uint8_t>(mode[i]);
    }
    return DFM_OK;
  }
};

constexpr uint32_t kNeeds = DFM_NEED_FN | DFM_NEED_VT | DFM_NEED_AREA;
constexpr uint32_t kFlags = DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_JACOBIAN;
constexpr dfm_slot kSlots[] = {{DFM_PER_CONTACT, 2, DFM_SLOT_TANGENT, 0}};

template <class Law>
constexpr dfm_friction ops() {
  dfm_friction f = dfm::plugin::friction(kNeeds, kFlags, lanes::eval<Law>, Law::check);
  f.nslot = 1;
  f.slots = kSlots;
  f.prepare = Law::prepare;
  f.release = Law::release;
  return f;
}

}  // namespace bristle
