// The kernels on vectors of four doubles, written once for the files that bring `v4` and its operations
// (model_common/lanes_avx.h, lanes_sse2.h). Everything here has internal linkage.
#pragma once
#include <stddef.h>

#include "../model_common/block_lanes.h"
#include "../model_common/plastic.h"
#include "../model_common/polar_lanes.h"
#include "corot_kernel.h"
#include "corot_collapse.h"

namespace corot {
namespace {

using namespace lanes;
using namespace model::plastic;

// Four cells of a group, from lane `at` on.
struct Four {
  const Group *group;
  uint32_t at;
};
DEFORM_INLINE const uint32_t *cell(const Four &q, int k) { return q.group->p[q.at + uint32_t(k)]; }
DEFORM_INLINE v4 rest4(const Four &q, int k) { return load4(q.group->g[k] + q.at); }

// f += e (x) g for the edges from corner 0 to corner n; kOffset 0: positions, 4: velocities.
template <int kOffset>
DEFORM_INLINE void add_edges(const Block &b, const Four &q, int n, v4 o0, v4 o1, v4 o2, v4 o3, v4 *f) {
  const auto corner = [&](int k) __attribute__((always_inline)) {
    return load4(b.p + 8 * size_t(cell(q, k)[n]) + kOffset);
  };
  v4 x = corner(0) - o0, y = corner(1) - o1, z = corner(2) - o2, unused = corner(3) - o3;
  transpose(x, y, z, unused);
  for (int a = 0; a < 3; ++a) {
    const v4 g = rest4(q, 3 * (n - 1) + a);
    f[a] = n == 1 ? x * g : f[a] + x * g;
    f[3 + a] = n == 1 ? y * g : f[3 + a] + y * g;
    f[6 + a] = n == 1 ? z * g : f[6 + a] + z * g;
  }
}
template <int kOffset>
DEFORM_INLINE void gradient(const Block &b, const Four &q, v4 *f) {
  const auto corner = [&](int k) __attribute__((always_inline)) {
    return load4(b.p + 8 * size_t(cell(q, k)[0]) + kOffset);
  };
  const v4 o0 = corner(0), o1 = corner(1), o2 = corner(2), o3 = corner(3);
  add_edges<kOffset>(b, q, 1, o0, o1, o2, o3, f);
  add_edges<kOffset>(b, q, 2, o0, o1, o2, o3, f);
  add_edges<kOffset>(b, q, 3, o0, o1, o2, o3, f);
}

static __attribute__((noinline)) void rotate_lanes(Rotate rotate, uint32_t which, const v4 *f, v4 *r) {
  alignas(32) double from[9][4], to[9][4];
  for (int k = 0; k < 9; ++k) {
    store4(from[k], f[k]);
    store4(to[k], r[k]);
  }
  for (int lane = 0; lane < 4; ++lane) {
    if (!(which >> lane & 1)) continue;
    double one[9], turned[9];
    for (int k = 0; k < 9; ++k) one[k] = from[k][lane];
    rotate(one, turned);
    for (int k = 0; k < 9; ++k) to[k][lane] = turned[k];
  }
  for (int k = 0; k < 9; ++k) r[k] = load4(to[k]);
}

DEFORM_INLINE void finish_rotation(const Block &b, const v4 *f, const model::Polar<Wide> &o, v4 *r) {
  model::polar_rotation(f, o, r);
  const uint32_t good = mask_above(o.divisor, splat(model::kPolarDivisor) * o.cube) &
                        mask_above(splat(model::kPolarStep) * o.trace, abs4(o.step)) &
                        mask_above(o.n, splat(model::kPolarLeastSquare));
  const uint32_t bad = b.rotate_all ? 15u : 15u & ~good;
  if (__builtin_expect(bad != 0, 0)) rotate_lanes(b.rotate, bad, f, r);
}

// Calls use(group, place of the first lane in it, F, R, its invariants) for every four cells of the block.
// The roots of some fours are found side by side, because each is a chain of divisions.
struct Pending {
  v4 f[9];
  model::Polar<Wide> o;
};
template <bool kRotations = true, class Use>
DEFORM_INLINE void each_four(const Block &b, const Use &use) {
  constexpr uint32_t kSide = 8;
  alignas(64) Pending pending[kSide];
  const uint32_t fours = b.groups * (kGroup / 4);
  for (uint32_t begin = 0; begin < fours; begin += kSide) {
    const uint32_t count = fours - begin < kSide ? fours - begin : kSide;
    for (uint32_t n = 0; n < count; ++n) {
      const Four q = {b.group + (begin + n) / 2, (begin + n) % 2 * 4};
      v4 f[9];
      model::Polar<Wide> o;
      gradient<0>(b, q, f);
      model::polar_invariants(f, o);
      for (int k = 0; k < 9; ++k) pending[n].f[k] = f[k];
      pending[n].o = o;
    }
    for (uint32_t n = 0; kRotations && n < count; ++n) model::polar_trace(pending[n].o);
    for (uint32_t n = 0; n < count; ++n) {
      v4 f[9], r[9];
      for (int k = 0; k < 9; ++k) f[k] = pending[n].f[k];
      if constexpr (kRotations) finish_rotation(b, f, pending[n].o, r);
      use((begin + n) / 2, (begin + n) % 2 * 4, f, r, pending[n].o);
    }
  }
}

// Symmetric part of R^T F less the identity: xx yy zz xy yz zx.
DEFORM_INLINE void strain_of(const v4 *r, const v4 *f, v4 *e) {
  const auto entry = [&](int i, int j) __attribute__((always_inline)) {
    return (r[i] * f[j] + r[3 + i] * f[3 + j]) + r[6 + i] * f[6 + j];
  };
  const v4 one = splat(1), half = splat(0.5);
  e[0] = entry(0, 0) - one;
  e[1] = entry(1, 1) - one;
  e[2] = entry(2, 2) - one;
  e[3] = half * (entry(0, 1) + entry(1, 0));
  e[4] = half * (entry(1, 2) + entry(2, 1));
  e[5] = half * (entry(2, 0) + entry(0, 2));
}

DEFORM_INLINE v4 trace_of(const v4 *e) { return (e[0] + e[1]) + e[2]; }

// Mean over the corners of the volume changes of points (kOffset 0), or of their rates (4).
template <int kOffset, bool kSquares = false>
DEFORM_INLINE v4 corner_mean(const Block &b, const Four &q) {
  v4 sum[4];
  for (int c = 0; c < 4; ++c) {
    v4 x[4];
    for (int a = 0; a < 4; ++a) {
      x[a] = load4(b.p + 8 * size_t(cell(q, c)[a]) + kOffset);
      if constexpr (kSquares) x[a] = x[a] * x[a];
    }
    sum[c] = (x[0] + x[1]) + (x[2] + x[3]);
  }
  transpose(sum[0], sum[1], sum[2], sum[3]);
  return splat(0.25) * sum[3];
}
DEFORM_INLINE v4 bulk4(const Four &q) {
  return load4(q.group->lambda + q.at) + splat(1.0 / 3) * load4(q.group->mu2 + q.at);
}

// State of four cells, and the constants of their flow.
DEFORM_INLINE void load_plastic(const Block &b, uint32_t n, const Four &q, PlasticState<Wide> &s,
                                PlasticLaw<Wide> &law) {
  v4 first[4], last[4];  // components 0 to 3, and 3 to 6
  for (uint32_t c = 0; c < 4; ++c) {
    const uint32_t number = b.cell[size_t(kGroup) * n + q.at + c];
    const double *own = b.state + size_t(kState) * (number == ~0u ? 0 : number);
    first[c] = load4_anywhere(own);
    last[c] = load4_anywhere(own + 3);
  }
  transpose(first[0], first[1], first[2], first[3]);
  transpose(last[0], last[1], last[2], last[3]);
  for (int k = 0; k < 6; ++k) s.strain[k] = k < 4 ? first[k] : last[k - 3];
  s.length = last[3];
  const PlasticGroup &own = b.plastic[n];
  law = {load4(q.group->mu2 + q.at), load4(own.yield + q.at), load4(own.hardening + q.at),
         load4(own.limit + q.at),    splat(b.flow),           splat(b.per_flow)};
}
DEFORM_INLINE void store_plastic(const Block &b, uint32_t n, const Four &q, const PlasticState<Wide> &s) {
  alignas(32) double one[kState][4];
  for (int k = 0; k < 6; ++k) store4(one[k], s.strain[k]);
  store4(one[6], s.length);
  for (uint32_t c = 0; c < 4; ++c) {
    const uint32_t number = b.cell[size_t(kGroup) * n + q.at + c];
    for (uint32_t k = 0; number != ~0u && k < kState; ++k)
      b.state_out[size_t(kState) * number + k] = one[k][c];
  }
}
// At the end of the flow for the strain e.
DEFORM_INLINE void flowed(const Block &b, uint32_t n, const Four &q, const v4 *e, PlasticState<Wide> &s) {
  PlasticLaw<Wide> law;
  PlasticFlow<Wide> flow;
  load_plastic(b, n, q, s, law);
  find_flow<Wide>(law, e, s, flow);
  take_flow(flow, s);
}
// Its potential less the energy of the elastic cell, times the volume.
DEFORM_INLINE v4 plastic_energy(const Block &b, uint32_t n, const Four &q, const v4 *e) {
  PlasticState<Wide> s;
  PlasticLaw<Wide> law;
  PlasticFlow<Wide> flow;
  load_plastic(b, n, q, s, law);
  find_flow<Wide>(law, e, s, flow);
  return flow_energy<Wide>(law, e, s, flow);
}

struct Fibers { v4 a[3], alpha, beta, shear; };
DEFORM_INLINE void load_fibers(const FiberGroup &g, uint32_t at, Fibers &out) {
  for (int k = 0; k < 3; ++k) out.a[k] = load4(g.axis[k] + at);
  out.alpha = load4(g.alpha + at);
  out.beta = load4(g.beta + at);
  out.shear = load4(g.shear + at);
}
// e a, and a.e a
DEFORM_INLINE v4 along(const v4 *e, const v4 *a, v4 *ea) {
  ea[0] = (e[0] * a[0] + e[3] * a[1]) + e[5] * a[2];
  ea[1] = (e[3] * a[0] + e[1] * a[1]) + e[4] * a[2];
  ea[2] = (e[5] * a[0] + e[4] * a[1]) + e[2] * a[2];
  return (a[0] * ea[0] + a[1] * ea[1]) + a[2] * ea[2];
}

// Stresses times volume. The isotropic one has the axes of the strain.
DEFORM_INLINE void stress_of(const Four &q, const v4 *e, v4 *s) {
  const v4 mu2 = load4(q.group->mu2 + q.at);
  const v4 pressure = load4(q.group->lambda + q.at) * trace_of(e);
  for (int k = 0; k < 6; ++k) s[k] = k < 3 ? mu2 * e[k] + pressure : mu2 * e[k];
}
// With the volume change of the points in place of the cell's.
DEFORM_INLINE void nodal_stress(const Four &q, const v4 *e, v4 change, v4 *s) {
  const v4 mu2 = load4(q.group->mu2 + q.at);
  const v4 pressure = bulk4(q) * change - splat(1.0 / 3) * (mu2 * trace_of(e));
  for (int k = 0; k < 6; ++k) s[k] = k < 3 ? mu2 * e[k] + pressure : mu2 * e[k];
}
DEFORM_INLINE void fiber_stress(const FiberGroup &g, uint32_t at, const v4 *e, v4 *s) {
  Fibers c;
  load_fibers(g, at, c);
  v4 ea[3], pull[3];
  const v4 t = trace_of(e), q = along(e, c.a, ea), more = c.alpha * q, both = c.alpha * t + c.beta * q;
  for (int k = 0; k < 3; ++k) pull[k] = splat(0.5) * (both * c.a[k]) + c.shear * ea[k];
  const auto pair = [&](int i, int j)
                        __attribute__((always_inline)) { return c.a[i] * pull[j] + pull[i] * c.a[j]; };
  s[0] = pair(0, 0) + more;
  s[1] = pair(1, 1) + more;
  s[2] = pair(2, 2) + more;
  s[3] = pair(0, 1);
  s[4] = pair(1, 2);
  s[5] = pair(2, 0);
}

DEFORM_INLINE void add_fiber_stress(const FiberGroup &g, uint32_t at, const v4 *e, v4 *s) {
  v4 more[6];
  fiber_stress(g, at, e, more);
  for (int k = 0; k < 6; ++k) s[k] = s[k] + more[k];
}

// -P g of corner k + 1 of the four cells, added there and returned.
DEFORM_INLINE void spread(const Block &b, const Four &q, int k, const v4 *stress, v4 *out) {
  const v4 gx = rest4(q, 3 * k), gy = rest4(q, 3 * k + 1), gz = rest4(q, 3 * k + 2);
  for (int i = 0; i < 3; ++i)
    out[i] = splat(0) - ((stress[3 * i] * gx + stress[3 * i + 1] * gy) + stress[3 * i + 2] * gz);
  out[3] = splat(0);
  transpose(out[0], out[1], out[2], out[3]);
  for (int c = 0; c < 4; ++c) add_to(b, cell(q, c)[k + 1], out[c]);
}

// P = R s
DEFORM_INLINE void turn(const v4 *r, const v4 *s, v4 *p) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      p[3 * i + j] = (r[3 * i] * s[j] + r[3 * i + 1] * s[3 + j]) + r[3 * i + 2] * s[6 + j];
}
DEFORM_INLINE void full(const v4 *s, v4 *out) {
  out[0] = s[0];
  out[4] = s[1];
  out[8] = s[2];
  out[1] = out[3] = s[3];
  out[5] = out[7] = s[4];
  out[2] = out[6] = s[5];
}
DEFORM_INLINE void times(const v4 *m, const v4 *x, v4 *out) {
  out[0] = (m[0] * x[0] + m[3] * x[1]) + m[5] * x[2];
  out[1] = (m[3] * x[0] + m[1] * x[1]) + m[4] * x[2];
  out[2] = (m[5] * x[0] + m[4] * x[1]) + m[2] * x[2];
}

// The frame turns with the material, R^T dR = [w]x with (t I - S) w = axial(R^T dF), t = tr S. The inverse
// of that matrix is adjoint / det. Where two stretches cancel det vanishes, and what needs the inverse
// fades with share = det / max(det, kMinPair t^3): `inverse` is share times the inverse, no eigenvalue
// above 1/(kMinPair t).
struct Turning { v4 inverse[6], share; };
DEFORM_INLINE void turning(const v4 *s, Turning &out) {
  const v4 t = (s[0] + s[1]) + s[2], a = t - s[0], b = t - s[1], c = t - s[2];
  const v4 xx = b * c - s[4] * s[4], xy = s[5] * s[4] + s[3] * c, zx = s[3] * s[4] + b * s[5];
  const v4 det = (a * xx - s[3] * xy) - s[5] * zx;
  const v4 over = splat(1) / max4(det, splat(kMinPair) * ((t * t) * t) + splat(1e-300));
  out.share = det * over;
  out.inverse[0] = over * xx;
  out.inverse[1] = over * (a * c - s[5] * s[5]);
  out.inverse[2] = over * (a * b - s[3] * s[3]);
  out.inverse[3] = over * xy;
  out.inverse[4] = over * (a * s[4] + s[3] * s[5]);
  out.inverse[5] = over * zx;
}

// share dS/dt: the symmetric part of A - [w]x S with A = R^T dF/dt.
DEFORM_INLINE void strain_rate(const v4 *r, const v4 *rate, const v4 *s, const Turning &turn_by, v4 *e) {
  v4 a[9], axial[3], w[3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      a[3 * i + j] = (r[i] * rate[j] + r[3 + i] * rate[3 + j]) + r[6 + i] * rate[6 + j];
  axial[0] = a[7] - a[5];
  axial[1] = a[2] - a[6];
  axial[2] = a[3] - a[1];
  times(turn_by.inverse, axial, w);
  const v4 half = splat(0.5), xy = w[2] * s[3], yz = w[0] * s[4], zx = w[1] * s[5], share = turn_by.share;
  e[0] = share * a[0] - (zx - xy);
  e[1] = share * a[4] - (xy - yz);
  e[2] = share * a[8] - (yz - zx);
  const v4 w01 = w[2] * (s[0] - s[1]) + (w[1] * s[4] - w[0] * s[5]);
  const v4 w12 = w[0] * (s[1] - s[2]) + (w[2] * s[5] - w[1] * s[3]);
  const v4 w20 = w[1] * (s[2] - s[0]) + (w[0] * s[3] - w[2] * s[4]);
  e[3] = half * (share * (a[1] + a[3]) - w01);
  e[4] = half * (share * (a[5] + a[7]) - w12);
  e[5] = half * (share * (a[2] + a[6]) - w20);
}

// A stress whose axes are not those of S (fibers, dampers) works on dS as R (stress - [q]x) works on dF, (t
// I - S) q = axial(stress S): the transpose of strain_rate. It leaves no torque. out += share (stress -
// [q]x).
DEFORM_INLINE void balance(const v4 *stress, const v4 *s, const Turning &turn_by, v4 *out) {
  v4 axial[3], q[3], own[9];
  axial[0] = ((stress[5] * s[3] + stress[4] * s[1]) + stress[2] * s[4]) -
             ((stress[3] * s[5] + stress[1] * s[4]) + stress[4] * s[2]);
  axial[1] = ((stress[0] * s[5] + stress[3] * s[4]) + stress[5] * s[2]) -
             ((stress[5] * s[0] + stress[4] * s[3]) + stress[2] * s[5]);
  axial[2] = ((stress[3] * s[0] + stress[1] * s[3]) + stress[4] * s[5]) -
             ((stress[0] * s[3] + stress[3] * s[1]) + stress[5] * s[4]);
  times(turn_by.inverse, axial, q);
  full(stress, own);
  for (int k = 0; k < 9; ++k) out[k] = out[k] + turn_by.share * own[k];
  out[1] = out[1] + q[2];
  out[3] = out[3] - q[2];
  out[5] = out[5] + q[0];
  out[7] = out[7] - q[0];
  out[6] = out[6] + q[1];
  out[2] = out[2] - q[1];
}

// What fibers, dampers and plastic strain (kMore) add to the stress of a cell in its frame; f is lost.
template <bool kFiber, bool kDamped, bool kMore>
DEFORM_INLINE void add_others(const Block &b, uint32_t n, const Four &q, const v4 *r, const v4 *e, v4 *f,
                              v4 *all) {
  v4 s[6], other[6];
  Turning turn_by;
  for (int k = 0; k < 6; ++k) s[k] = k < 3 ? e[k] + splat(1) : e[k];
  turning(s, turn_by);
  if constexpr (kDamped) {
    v4 rate[6];
    gradient<4>(b, q, f);
    strain_rate(r, f, s, turn_by, rate);
    const v4 damp = load4(b.damp + size_t(kGroup) * n + q.at);
    for (int k = 0; k < 6; ++k) rate[k] = damp * rate[k];
    if (kMore && b.nodal) nodal_stress(q, rate, damp * corner_mean<4>(b, q), other);
    else stress_of(q, rate, other);
    for (int k = 0; k < 6; ++k) rate[k] = rate[k] + e[k];
    if constexpr (kFiber) add_fiber_stress(b.fiber[n], q.at, rate, other);
  } else if constexpr (kFiber) {
    fiber_stress(b.fiber[n], q.at, e, other);
  } else {
    for (int k = 0; k < 6; ++k) other[k] = splat(0);
  }
  if (kMore && b.plastic) {
    PlasticState<Wide> state;
    flowed(b, n, q, e, state);
    const v4 mu2 = load4(q.group->mu2 + q.at);
    for (int k = 0; k < 6; ++k) other[k] = other[k] - mu2 * state.strain[k];
    if (b.state_out) store_plastic(b, n, q, state);
  }
  balance(other, s, turn_by, all);
}

// P V of the energies of the gradient; see Energy.
template <Energy kEnergy>
DEFORM_INLINE void direct_stress(const Four &q, const v4 *f, const model::Polar<Wide> &o, v4 *p) {
  const v4 mu2 = load4(q.group->mu2 + q.at), lambda = load4(q.group->lambda + q.at), one = splat(1);
  if constexpr (kEnergy == kNeoHookean) {
    const v4 m = splat(2.0 / 3) * mu2, l = lambda + splat(5.0 / 12) * mu2;
    const v4 pull = m - m / (o.n + one), pressure = l * (o.det - one) - splat(0.75) * m;
    for (int k = 0; k < 9; ++k) p[k] = pull * f[k] + pressure * o.cofactor[k];
  } else {
    v4 s[6];
    const v4 half = splat(0.5), pressure = half * (lambda * (o.n - splat(3)));
    for (int k = 0; k < 6; ++k)
      s[k] = k < 3 ? half * (mu2 * (o.c[k] - one)) + pressure : half * (mu2 * o.c[k]);
    v4 all[9];
    full(s, all);
    turn(f, all, p);
  }
}

// Is one of four cells so flat that it resists collapse? Asked only in kernels for blocks whose cells can.
DEFORM_INLINE bool resists(const model::Polar<Wide> &o, double flat = kFlat) {
  return __builtin_expect(mask_above(splat(flat), o.det) != 0, 0);
}
DEFORM_INLINE Collapse<Wide> collapse_of(const Block &b, const Four &q, v4 det) {
  const v4 young = b.fiber ? load4(b.fiber[q.group - b.group].young + q.at)
                           : young_of<Wide>(load4(q.group->mu2 + q.at), load4(q.group->lambda + q.at));
  return collapse_of<Wide>(b.collapse, det, young);
}

// P V of four cells; f is lost where there are dampers.
template <Energy kEnergy, bool kFiber, bool kDamped, bool kMore, bool kCollapse>
DEFORM_INLINE void piola(const Block &b, uint32_t n, const Four &q, v4 *f, const v4 *r,
                         const model::Polar<Wide> &o, v4 *p) {
  v4 e[6], stress[6], all[9];
  if constexpr (kEnergy == kLinear || kDamped) strain_of(r, f, e);
  if constexpr (kEnergy == kLinear) {
    if (kMore && b.nodal) nodal_stress(q, e, corner_mean<0>(b, q), stress);
    else stress_of(q, e, stress);
    full(stress, all);
    if (kFiber || kDamped || (kMore && b.plastic)) add_others<kFiber, kDamped, kMore>(b, n, q, r, e, f, all);
    turn(r, all, p);
    if (kCollapse && resists(o)) {
      const v4 pressure = collapse_of(b, q, o.det).pressure;
      for (int k = 0; k < 9; ++k) p[k] = p[k] - pressure * o.cofactor[k];
    }
  } else {
    direct_stress<kEnergy>(q, f, o, p);
    if constexpr (kDamped) {
      v4 damper[9];
      for (int k = 0; k < 9; ++k) all[k] = splat(0);
      add_others<false, true, false>(b, n, q, r, e, f, all);
      turn(r, all, damper);
      for (int k = 0; k < 9; ++k) p[k] = p[k] + damper[k];
    }
  }
}

template <Energy kEnergy, bool kFiber, bool kDamped, bool kMore = false, bool kCollapse = false>
static inline void cell_forces(const Block &b) {
  each_four<kEnergy == kLinear || kDamped>(
      b, [&](uint32_t n, uint32_t at, v4 *f, const v4 *r, const model::Polar<Wide> &o)
             __attribute__((always_inline)) {
               const Four q = {b.group + n, at};
               v4 p[9], sum[4], other[4];
               piola<kEnergy, kFiber, kDamped, kMore, kCollapse>(b, n, q, f, r, o, p);
               spread(b, q, 0, p, sum);
               for (int k = 1; k < 3; ++k) {
                 spread(b, q, k, p, other);
                 for (int c = 0; c < 4; ++c) sum[c] = sum[c] + other[c];
               }
               for (int c = 0; c < 4; ++c) add_to(b, cell(q, c)[0], splat(0) - sum[c]);
             });
}
// The share of a cell in the volume change of each of its points is k V/4 (tr S - 3), in its rate
// damp k V/4 d(tr S)/dt, faded as in strain_rate.
static inline void dilate(const Block &b) {
  each_four(b, [&](uint32_t n, uint32_t at, v4 *f, const v4 *r, const model::Polar<Wide> &o)
                   __attribute__((always_inline)) {
                     const Four q = {b.group + n, at};
                     const v4 quarter = splat(0.25) * bulk4(q);
                     v4 e[6];
                     strain_of(r, f, e);
                     v4 part[4] = {quarter * trace_of(e), splat(0), splat(0), splat(0)};
                     if (b.damp) {
                       v4 s[6];
                       Turning turn_by;
                       for (int k = 0; k < 6; ++k) s[k] = k < 3 ? e[k] + splat(1) : e[k];
                       turning(s, turn_by);
                       gradient<4>(b, q, f);
                       v4 rate = r[0] * f[0];
                       for (int k = 1; k < 9; ++k) rate = rate + r[k] * f[k];
                       part[1] = (load4(b.damp + size_t(kGroup) * n + at) * quarter) * (turn_by.share * rate);
                     }
                     transpose(part[0], part[1], part[2], part[3]);
                     for (int c = 0; c < 4; ++c)
                       for (int a = 0; a < 4; ++a) add_to(b, cell(q, c)[a], part[c]);
                   });
}

// Fibers go with neither `nodal` nor plastic flow, and only the linear energy with any of these.
template <bool kDamped>
static inline void forces_with(const Block &b) {
  if (b.energy == kNeoHookean) return cell_forces<kNeoHookean, false, kDamped>(b);
  if (b.energy == kVenant) return cell_forces<kVenant, false, kDamped>(b);
  if (b.collapse > 0)
    return b.fiber ? cell_forces<kLinear, true, kDamped, false, true>(b)
                   : cell_forces<kLinear, false, kDamped, true, true>(b);
  if (b.nodal || b.plastic) return cell_forces<kLinear, false, kDamped, true>(b);
  return b.fiber ? cell_forces<kLinear, true, kDamped>(b) : cell_forces<kLinear, false, kDamped>(b);
}
static inline void forces(const Block &b) { return b.damp ? forces_with<true>(b) : forces_with<false>(b); }

// Cauchy stress P F^T / J times V, without dampers, J no less than kMinVolume in size.
template <Energy kEnergy, bool kFiber, bool kMore = false, bool kCollapse = false>
static inline void cell_stresses(const Block &b, const uint32_t *cells, double *out) {
  each_four<kEnergy == kLinear>(b, [&](uint32_t n, uint32_t at, v4 *f, const v4 *r,
                                       const model::Polar<Wide> &o) __attribute__((always_inline)) {
    const Four q = {b.group + n, at};
    v4 p[9];
    alignas(32) double one[6][4];
    piola<kEnergy, kFiber, false, kMore, kCollapse>(b, n, q, f, r, o, p);
    const v4 over = splat(1) / max4(abs4(o.det), splat(kMinVolume));
    constexpr int kRow[6] = {0, 1, 2, 0, 1, 2}, kCol[6] = {0, 1, 2, 1, 2, 0};
    for (int k = 0; k < 6; ++k) {
      const v4 *x = p + 3 * kRow[k], *y = f + 3 * kCol[k];
      store4(one[k], over * ((x[0] * y[0] + x[1] * y[1]) + x[2] * y[2]));
    }
    for (uint32_t c = 0; c < 4; ++c) {
      const uint32_t number = cells[size_t(kGroup) * n + at + c];
      for (uint32_t k = 0; number != ~0u && k < 6; ++k) out[6 * size_t(number) + k] = one[k][c];
    }
  });
}
static inline void stresses(const Block &b, const uint32_t *cells, double *out) {
  if (b.energy == kNeoHookean) return cell_stresses<kNeoHookean, false>(b, cells, out);
  if (b.energy == kVenant) return cell_stresses<kVenant, false>(b, cells, out);
  if (b.collapse > 0)
    return b.fiber ? cell_stresses<kLinear, true, false, true>(b, cells, out)
                   : cell_stresses<kLinear, false, true, true>(b, cells, out);
  if (b.nodal || b.plastic) return cell_stresses<kLinear, false, true>(b, cells, out);
  return b.fiber ? cell_stresses<kLinear, true>(b, cells, out) : cell_stresses<kLinear, false>(b, cells, out);
}

// A cell has the share k V/2 mean(change^2) of its corners of the volume change: the sum over the cells is
// that over the points.
DEFORM_INLINE v4 nodal_energy(const Block &b, const Four &q, const v4 *e) {
  v4 way[6];
  const v4 third = splat(1.0 / 3) * trace_of(e);
  for (int k = 0; k < 6; ++k) way[k] = k < 3 ? e[k] - third : e[k];
  const v4 shape = load4(q.group->mu2 + q.at) * square_of<Wide>(way);
  return splat(0.5) * (shape + bulk4(q) * corner_mean<0, true>(b, q));
}
template <bool kFiber, bool kMore = false, bool kCollapse = false>
static inline void cell_energies(const Block &b) {
  each_four(b, [&](uint32_t n, uint32_t at, v4 *f, const v4 *r, const model::Polar<Wide> &o)
                   __attribute__((always_inline)) {
                     const Four q = {b.group + n, at};
                     v4 e[6], s[6];
                     strain_of(r, f, e);
                     stress_of(q, e, s);
                     if constexpr (kFiber) add_fiber_stress(b.fiber[n], at, e, s);
                     const v4 own = (e[0] * s[0] + e[1] * s[1]) + e[2] * s[2];
                     const v4 mixed = (e[3] * s[3] + e[4] * s[4]) + e[5] * s[5];
                     v4 sum = splat(0.5) * own + mixed;
                     if (kMore && b.nodal) sum = nodal_energy(b, q, e);
                     if (kMore && b.plastic) sum = sum + plastic_energy(b, n, q, e);
                     if (kCollapse && resists(o)) sum = sum + collapse_of(b, q, o.det).energy;
                     store4(b.value + size_t(kGroup) * n + at, sum);
                   });
}
static inline void energies(const Block &b) {
  if (b.collapse > 0)
    return b.fiber ? cell_energies<true, false, true>(b) : cell_energies<false, true, true>(b);
  if (b.nodal || b.plastic) return cell_energies<false, true>(b);
  return b.fiber ? cell_energies<true>(b) : cell_energies<false>(b);
}

// Largest eigenvalue of a symmetric 3 x 3 matrix, or a little more, from its trace and the square of its
// norm.
DEFORM_INLINE v4 most_of(v4 trace, v4 square) {
  const v4 third = splat(1.0 / 3);
  return third * trace + sqrt4(splat(2.0 / 3) * max4(square - third * (trace * trace), splat(0)));
}
DEFORM_INLINE v4 direct_stiffness(uint32_t energy, const Four &q, const model::Polar<Wide> &o) {
  const v4 mu2 = load4(q.group->mu2 + q.at), lambda = load4(q.group->lambda + q.at), zero = splat(0);
  const v4 square = splat(0.5) * (o.constant + o.n * o.n);  // |C|^2
  const v4 longest = max4(most_of(o.n, square), zero);      // of the squared stretches
  if (energy == kVenant) {
    const v4 pull = splat(0.5) * (lambda * (o.n - splat(3)) + mu2 * (longest - splat(1)));
    return (lambda + mu2) * longest + max4(pull, zero);
  }
  const v4 m = splat(2.0 / 3) * mu2, l = lambda + splat(5.0 / 12) * mu2, n1 = o.n + splat(1);
  const v4 pairs = splat(0.5) * (o.n * o.n - square), pressure = l * (o.det - splat(1)) - splat(0.75) * m;
  const v4 area = max4(most_of(pairs, pairs * pairs - splat(2) * (o.n * (o.det * o.det))), zero);
  const v4 by = choose_above(pressure, zero, splat(2) * pressure, zero - pressure);
  return ((m - m / n1) + (splat(2) * (m * longest)) / (n1 * n1)) + (l * area + by * sqrt4(longest));
}

// The stiffness of cells that resist collapse or soon will: C (dJ)^2 - p d2J at most, times the volume.
DEFORM_INLINE v4 collapse_stiffness(const Block &b, const Four &q, const model::Polar<Wide> &o) {
  const v4 zero = splat(0), square = splat(0.5) * (o.constant + o.n * o.n);  // |C|^2
  const v4 longest = max4(most_of(o.n, square), zero), pairs = splat(0.5) * (o.n * o.n - square);
  const v4 area = max4(most_of(pairs, pairs * pairs - splat(2) * (o.n * (o.det * o.det))), zero);
  const Collapse<Wide> flat = collapse_of(b, q, o.det - splat(kFalls));
  return choose_above(splat(kFlat + kFalls), o.det, flat.stiffness * area + flat.pressure * sqrt4(longest),
                      zero);
}

// What the rows of the bound count beyond the rest shape; corot_bound.cpp derives it. From the trace t of
// the stretch and n = |F|^2: the mean stretch m = t/3 and the variance n/3 - m^2 enclose each stretch
// within sqrt(2 variance) of m, the sum of two of them within 2 m -+ that, and the square of the difference
// of two below 6 variances.
template <bool kFiber, bool kCollapse>
static inline void cell_twists(const Block &b) {
  each_four(b, [&](uint32_t n, uint32_t at, v4 *f, const v4 *r,
                   const model::Polar<Wide> &o) __attribute__((always_inline)) {
    const Four q = {b.group + n, at};
    v4 square = f[0] * f[0], t = r[0] * f[0];
    for (int k = 1; k < 9; ++k) {
      square = square + f[k] * f[k];
      t = t + r[k] * f[k];
    }
    const v4 third = splat(1.0 / 3), mean = third * t, zero = splat(0);
    const v4 variance = max4(third * square - mean * mean, zero);
    const v4 far = sqrt4(splat(2) * variance), most = splat(2) * mean + far;
    const v4 least = max4(splat(2) * mean - far, splat(kMinPair) * t) + splat(1e-300);
    const v4 mu2 = load4(q.group->mu2 + at);
    const v4 uneven = (splat(6) * variance) / (least * least);  // (s_i - s_j)^2 / (s_i + s_j)^2 at most
    v4 twist;
    if (b.energy != kLinear) {
      twist = direct_stiffness(b.energy, q, o);
    } else if constexpr (kFiber) {
      v4 e[6], stress[6];
      strain_of(r, f, e);
      stress_of(q, e, stress);
      add_fiber_stress(b.fiber[n], at, e, stress);
      const v4 own = (stress[0] * stress[0] + stress[1] * stress[1]) + stress[2] * stress[2];
      const v4 mixed = (stress[3] * stress[3] + stress[4] * stress[4]) + stress[5] * stress[5];
      const v4 size = sqrt4(own + splat(2) * mixed), longest = mean + far;
      const v4 turn_by = (splat(6) * sqrt4(splat(1) + uneven)) / least +
                         (splat(6) * (longest * longest)) / ((least * least) * least);
      twist = load4(b.fiber[n].most + at) * (splat(1.4143) * sqrt4(uneven) + splat(0.5) * uneven) +
              size * turn_by;
    } else {
      v4 c = load4(q.group->lambda + at) * (t - splat(3)) - mu2;
      if (b.nodal) c = (bulk4(q) * corner_mean<0>(b, q) - third * (mu2 * (t - splat(3)))) - mu2;
      twist =
          splat(0.5) * max4(mu2 + (splat(2) * c) / choose_above(c, zero, least, most + splat(1e-300)), zero);
      if (b.plastic) {
        v4 e[6];
        PlasticState<Wide> state;
        strain_of(r, f, e);
        flowed(b, n, q, e, state);
        const v4 size = mu2 * sqrt4(square_of<Wide>(state.strain));
        twist = twist + (splat(2.8285) * (size * (splat(1) + uneven))) / least;
      }
    }
    if (kCollapse && resists(o, kFlat + kFalls)) twist = twist + collapse_stiffness(b, q, o);
    const size_t place = size_t(kGroup) * n + at;
    store4(b.value + place, twist);
    if (!b.damp) return;
    const v4 stiff = kFiber ? load4(b.fiber[n].most + at) : mu2;
    store4(b.damp_value + place,
           load4(b.damp + place) *
               (stiff * (kFiber ? splat(1.4143) * sqrt4(uneven) + splat(0.5) * uneven : uneven)));
  });
}
static inline void twists(const Block &b) {
  if (b.collapse > 0) return b.fiber ? cell_twists<true, true>(b) : cell_twists<false, true>(b);
  return b.fiber ? cell_twists<true, false>(b) : cell_twists<false, false>(b);
}

// Blocks of R K_e R^T with q_a = R g_a: lambda q_a q_b^T + mu (q_b q_a^T + g_a.g_b I); with p the turned
// axis and c_a = a.g_a the fibers add what the stress of fiber_stress does at corner a for the strain of a
// motion of corner b.
struct Turned { v4 q[4][3], g[4][3], axis[3], along[4], alpha, beta, shear; };
template <bool kFiber>
DEFORM_INLINE void block_of(const Turned &t, int a, int b, v4 lambda, v4 mu, v4 *out) {
  const v4 *const x = t.q[a];
  const v4 *const y = t.q[b];
  const v4 gg = (t.g[a][0] * t.g[b][0] + t.g[a][1] * t.g[b][1]) + t.g[a][2] * t.g[b][2];
  v4 same = mu * gg;
  const v4 *const p = t.axis;
  v4 right[3], left[3];  // right p^T + p left^T
  if constexpr (kFiber) {
    const v4 ca = t.along[a], cb = t.along[b], cc = ca * cb, half = splat(0.5) * t.shear;
    same = same + half * cc;
    const v4 own = splat(0.5) * (t.beta * cc + half * gg);
    const v4 xr = t.alpha * cb, yr = half * ca, yl = t.alpha * ca, xl = half * cb;
    for (int k = 0; k < 3; ++k) {
      right[k] = (xr * x[k] + yr * y[k]) + own * p[k];
      left[k] = (yl * y[k] + xl * x[k]) + own * p[k];
    }
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      v4 sum = lambda * (x[i] * y[j]) + mu * (y[i] * x[j]);
      if constexpr (kFiber) sum = sum + (right[i] * p[j] + p[i] * left[j]);
      out[3 * i + j] = i == j ? sum + same : sum;
    }
}
template <bool kFiber, bool kCollapse>
static inline void cell_tangents(const Block &b, double a, double damp, double *blk) {
  constexpr int kFirst[10] = {0, 1, 2, 3, 0, 0, 0, 1, 1, 2}, kSecond[10] = {0, 1, 2, 3, 1, 2, 3, 2, 3, 3};
  each_four(b, [&](uint32_t n, uint32_t at, v4 *f, const v4 *r,
                   const model::Polar<Wide> &o) __attribute__((always_inline)) {
    const Four q = {b.group + n, at};
    Turned t;
    for (int c = 1; c < 4; ++c)
      for (int k = 0; k < 3; ++k) t.g[c][k] = rest4(q, 3 * (c - 1) + k);
    for (int c = 1; c < 4; ++c)
      for (int k = 0; k < 3; ++k)
        t.q[c][k] = (r[3 * k] * t.g[c][0] + r[3 * k + 1] * t.g[c][1]) + r[3 * k + 2] * t.g[c][2];
    for (int k = 0; k < 3; ++k) {
      t.g[0][k] = splat(0) - ((t.g[1][k] + t.g[2][k]) + t.g[3][k]);
      t.q[0][k] = splat(0) - ((t.q[1][k] + t.q[2][k]) + t.q[3][k]);
    }
    v4 by = splat(a);
    if (b.damp) by = by + splat(damp) * load4(b.damp + size_t(kGroup) * n + at);
    if constexpr (kFiber) {
      Fibers c;
      load_fibers(b.fiber[n], at, c);
      for (int k = 0; k < 3; ++k)
        t.axis[k] = (r[3 * k] * c.a[0] + r[3 * k + 1] * c.a[1]) + r[3 * k + 2] * c.a[2];
      for (int k = 0; k < 4; ++k) t.along[k] = (c.a[0] * t.g[k][0] + c.a[1] * t.g[k][1]) + c.a[2] * t.g[k][2];
      t.alpha = by * c.alpha;
      t.beta = by * c.beta;
      t.shear = by * c.shear;
    }
    const v4 mu2 = load4(q.group->mu2 + at), mu = splat(0.5) * (by * mu2);
    // where `nodal` the volume change has blocks of its own
    const v4 lambda = by * (b.nodal ? splat(-1.0 / 3) * mu2 : load4(q.group->lambda + at));
    const bool flat = kCollapse && resists(o);
    v4 dyad = splat(0), area[4][3];  // cof F g of the corners
    if (flat) {
      dyad = choose_above(splat(kFlat), o.det, splat(a) * collapse_of(b, q, o.det).stiffness, splat(0));
      for (int c = 0; c < 4; ++c)
        for (int k = 0; k < 3; ++k)
          area[c][k] = (o.cofactor[3 * k] * t.g[c][0] + o.cofactor[3 * k + 1] * t.g[c][1]) +
                       o.cofactor[3 * k + 2] * t.g[c][2];
    }
    for (int m = 0; m < 10; ++m) {
      v4 one[9];
      block_of<kFiber>(t, kFirst[m], kSecond[m], lambda, mu, one);
      for (int k = 0; flat && k < 9; ++k)
        one[k] = one[k] + dyad * (area[kFirst[m]][k / 3] * area[kSecond[m]][k % 3]);
      alignas(32) double last[4];
      transpose(one[0], one[1], one[2], one[3]);
      transpose(one[4], one[5], one[6], one[7]);
      store4(last, one[8]);
      for (uint32_t c = 0; c < 4; ++c) {
        double *const out = blk + 9 * size_t(b.slots[n].slot[m][at + c]);
        store4_anywhere(out, load4_anywhere(out) - one[c]);
        store4_anywhere(out + 4, load4_anywhere(out + 4) - one[4 + c]);
        out[8] -= last[c];
      }
    }
  });
}
static inline void tangents(const Block &b, double a, double damp, double *blk) {
  if (b.collapse > 0)
    return b.fiber ? cell_tangents<true, true>(b, a, damp, blk) : cell_tangents<false, true>(b, a, damp, blk);
  return b.fiber ? cell_tangents<true, false>(b, a, damp, blk) : cell_tangents<false, false>(b, a, damp, blk);
}

constexpr Kernels kKernels = {load_block, dilate,   forces,     stresses,   energies,
                              twists,     tangents, merge_halo, add_to_host};

}  // namespace
}  // namespace corot
