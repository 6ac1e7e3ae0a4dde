// Coulomb friction with stiction, Stribeck effect and viscous part, as true stick and slip (never smoothed at zero speed).
//
//   g(w) = F_C + (F_S - F_C) exp(-(w/v_s)^delta),   F_C = mu_C fn, F_S = mu_S fn, w = |v|        (Stribeck curve, N)
//   stick  |ft_stop| <= F_S:  ft = ft_stop, the force that makes the slip of this step zero
//   slip   otherwise:         ft = -(g(w) + sigma2 A w) v/w; from rest (w = 0) along ft_stop, which is where the contact is about to go
//
// Olsson et al. 1998, eq. 2 and 3 (static part); implicit step as projection on the disc of radius F_S. Derivatives at w > 0:
//   dft/dv = -[F' v^v^T + (F/w) (1 - v^v^T)],  F = g + sigma2 A w,  F' = g' + sigma2 A,  dft/dfn = -(g/fn) v^
// A lane with a NaN or an infinite input gives NaN in that lane alone. Each lane runs the same operations at every vector width.
#include <cmath>

#include "deform/plugin.hpp"

namespace {

enum { kMuC, kMuS, kVs, kDelta, kSigma2 };
const dfm_param rows[] = {
    dfm::plugin::param("mu_C", "kinetic friction coefficient", "1", 0, 100, 0.5, DFM_PARAM_RUNTIME),
    dfm::plugin::param("mu_S", "static friction coefficient", "1", 0, 100, 0.5, DFM_PARAM_RUNTIME),
    dfm::plugin::param("v_s", "Stribeck speed", "m/s", 1e-9, 1e3, 0.01, DFM_PARAM_RUNTIME | DFM_PARAM_LOG_SCALE),
    dfm::plugin::param("delta", "Stribeck exponent", "1", 0.1, 10, 2, DFM_PARAM_RUNTIME),
    dfm::plugin::param("sigma2", "viscous friction per area", "N s/m^3", 0, 1e12, 0, DFM_PARAM_RUNTIME),
};

constexpr double kTiny = 1e-280, kHuge = 1e280;  // squares beyond these have lost digits or are about to
constexpr double kRest = 1e-140;                 // m/s; below it 1/w is held constant, so that no derivative is infinite

// The share of the Stribeck excess at speed w, and minus its logarithmic slope times w: s(w) = exp(-a), w s'(w) = -delta a s, a = (w/v_s)^delta.
inline double stribeck(double w, double v_s, double delta, double *slope) {
  const double x = w / v_s, a = delta == 2.0 ? x * x : delta == 1.0 ? x : dfm_pow(x, delta);
  const double s = dfm_exp(-a);
  *slope = s > 0 ? -delta * a * s : 0.0;  // a may be infinite where s has vanished
  return s;
}

// Length and direction of a vector, scaled by its larger component where squares would leave the range of doubles.
struct Polar { double length, x, y; };

Polar polar_scaled(double x, double y) {
  const double m = std::fabs(x) > std::fabs(y) ? std::fabs(x) : std::fabs(y);
  if (!(m > 0)) return {m, 0, 0};  // zero, or NaN
  const double u = x / m, v = y / m, r = std::sqrt(u * u + v * v);
  return {m * r, u / r, v / r};
}

inline Polar polar(double x, double y) {
  const double square = x * x + y * y;
  if (!(square > kTiny && square < kHuge)) return polar_scaled(x, y);
  const double r = std::sqrt(square);
  return {r, x / r, y / r};
}

dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  const double *p = in->params;
  const double mu_c = p[kMuC], mu_s = p[kMuS], v_s = p[kVs], delta = p[kDelta], sigma2 = p[kSigma2];
  const size_t stride = in->stride;
  const bool curve = mu_s != mu_c;
  for (uint32_t i = 0; i < in->n; ++i) {
    const double fn = in->fn[i], vx = in->vt[i], vy = in->vt[stride + i], sx = in->ft_stop[i], sy = in->ft_stop[stride + i];
    const double drag = sigma2 * in->area[i];
    // 0 where everything is finite, NaN otherwise: added to each output, it keeps a bad lane from passing for a good one.
    const double poison = 0.0 * fn + 0.0 * vx + 0.0 * vy + 0.0 * sx + 0.0 * sy + 0.0 * drag;
    double fx = 0, fy = 0, limit = 0, xx = 0, xy = 0, yy = 0, nx = 0, ny = 0;
    uint8_t mode = 0;
    if (fn > 0) {
      const Polar stop = polar(sx, sy);
      const double stiction = mu_s * fn;
      if (stop.length <= stiction) {
        fx = sx, fy = sy, limit = stiction, mode = 1;
      } else {
        const Polar v = polar(vx, vy);
        const double w = v.length;
        double mu = mu_s, slope = 0, dx = stop.x, dy = stop.y;
        if (w > 0) {
          mu = curve ? mu_c + (mu_s - mu_c) * stribeck(w, v_s, delta, &slope) : mu_c;
          dx = -v.x, dy = -v.y;
        }
        limit = mu * fn + drag * w, mode = 2;
        fx = limit * dx, fy = limit * dy, nx = mu * dx, ny = mu * dy;
        if (w > 0) {
          const double divisor = w > kRest ? w : kRest;
          const double across = limit / divisor, along = ((mu_s - mu_c) * fn * slope + drag * w) / divisor, d = along - across;
          xx = -(across + d * dx * dx), xy = -(d * dx * dy), yy = -(across + d * dy * dy);
        }
      }
    }
    if (out->ft) out->ft[i] = fx + poison, out->ft[stride + i] = fy + poison;
    if (out->limit) out->limit[i] = limit + poison;
    if (out->mode) out->mode[i] = mode;
    if (out->dft_dfn) out->dft_dfn[i] = nx + poison, out->dft_dfn[stride + i] = ny + poison;
    if (out->dft_dvt) {
      double *d = out->dft_dvt + i;
      d[0] = xx + poison, d[stride] = xy + poison, d[2 * stride] = xy + poison, d[3 * stride] = yy + poison;
    }
    if (out->stored) out->stored[i] = poison;
  }
  return DFM_OK;
}

dfm_status check(const double *p, char *why, size_t cap) {
  if (p[kMuS] >= p[kMuC]) return DFM_OK;
  std::snprintf(why, cap, "mu_S (%g) must not be below mu_C (%g); give both, or \"mu\" for mu_C = mu_S", p[kMuS], p[kMuC]);
  return DFM_E_ARG;
}

const dfm_friction law = dfm::plugin::friction(DFM_NEED_FN | DFM_NEED_VT | DFM_NEED_FT_STOP | DFM_NEED_AREA,
                                               DFM_FRIC_SET_VALUED | DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_JACOBIAN, eval, check);
const char *const effects[] = {"stiction", "stribeck", "viscous", nullptr};
const dfm_type coulomb = dfm::plugin::type(DFM_KIND_FRICTION, "org.deform.coulomb", "Coulomb friction with stiction, Stribeck effect and viscous part",
                                           "0.1.0", "MIT", "Olsson, Astrom, Canudas de Wit, Gafvert, Lischinsky 1998, eq. 2-3; set-valued at rest",
                                           rows, effects, &law);

}  // namespace

DFM_PLUGIN(&coulomb)
