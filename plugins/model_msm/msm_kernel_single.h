// The kernels in single precision, written once for registers of DEFORM_LANES floats, 4 or 8. Each lane is
// one spring or one cell and does the operations of the others; sums per point run in double, spring after
// spring and cell after cell. So the width never shows in a result. Internal linkage only.
#pragma once
#include "msm_kernel_quad.h"

namespace msm {
namespace {
namespace single {

typedef float vf __attribute__((vector_size(4 * DEFORM_LANES)));
typedef int32_t vi __attribute__((vector_size(4 * DEFORM_LANES)));
constexpr uint32_t kLanes = DEFORM_LANES, kGroups = kLanes / 4;

#if DEFORM_LANES == 8
typedef __m256 Raw;
typedef __m256d RawPairs;
template <class At>
DEFORM_INLINE vi groups(At at) {
  return (vi)_mm256_inserti128_si256(_mm256_castsi128_si256(_mm_load_si128(at(0))), _mm_load_si128(at(1)), 1);
}
DEFORM_INLINE vf root(vf a) { return (vf)_mm256_sqrt_ps((Raw)a); }
DEFORM_INLINE bool any(vi mask) { return _mm256_movemask_ps((Raw)mask); }
DEFORM_INLINE vf low_ones(vf a, vf b) { return (vf)_mm256_unpacklo_ps((Raw)a, (Raw)b); }
DEFORM_INLINE vf high_ones(vf a, vf b) { return (vf)_mm256_unpackhi_ps((Raw)a, (Raw)b); }
DEFORM_INLINE vf low_pairs(vf a, vf b) { return (vf)_mm256_unpacklo_pd((RawPairs)a, (RawPairs)b); }
DEFORM_INLINE vf high_pairs(vf a, vf b) { return (vf)_mm256_unpackhi_pd((RawPairs)a, (RawPairs)b); }
#else
typedef __m128 Raw;
typedef __m128d RawPairs;
template <class At>
DEFORM_INLINE vi groups(At at) {
  return (vi)_mm_load_si128(at(0));
}
DEFORM_INLINE vf root(vf a) { return (vf)_mm_sqrt_ps((Raw)a); }
DEFORM_INLINE bool any(vi mask) { return _mm_movemask_ps((Raw)mask); }
DEFORM_INLINE vf low_ones(vf a, vf b) { return (vf)_mm_unpacklo_ps((Raw)a, (Raw)b); }
DEFORM_INLINE vf high_ones(vf a, vf b) { return (vf)_mm_unpackhi_ps((Raw)a, (Raw)b); }
DEFORM_INLINE vf low_pairs(vf a, vf b) { return (vf)_mm_unpacklo_pd((RawPairs)a, (RawPairs)b); }
DEFORM_INLINE vf high_pairs(vf a, vf b) { return (vf)_mm_unpackhi_pd((RawPairs)a, (RawPairs)b); }
#endif

DEFORM_INLINE vf all(float a) { return vf{} + a; }
DEFORM_INLINE vf load(const float *p) { return *reinterpret_cast<const vf *>(p); }
DEFORM_INLINE vf larger(vf a, vf b) { return a > b ? a : b; }
DEFORM_INLINE vf smaller(vf a, vf b) { return a < b ? a : b; }

// Bits of to - from, of fixed-point places. One that is not finite is the least integer, and the difference
// wraps: the force is no number then, whatever the bits.
typedef uint32_t vu __attribute__((vector_size(4 * DEFORM_LANES)));
DEFORM_INLINE vf between(vi from, vi to) { return (vf)((vu)to - (vu)from); }

struct Three { vf x, y, z; };
DEFORM_INLINE Three operator+(const Three &a, const Three &b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
DEFORM_INLINE Three operator-(const Three &a, const Three &b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
DEFORM_INLINE Three operator*(vf a, const Three &b) { return {a * b.x, a * b.y, a * b.z}; }
DEFORM_INLINE vf dot(const Three &a, const Three &b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }
DEFORM_INLINE Three cross(const Three &a, const Three &b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Row k holds in group g the vector of lane 4 g + k.
DEFORM_INLINE Three columns(vf row0, vf row1, vf row2, vf row3) {
  const vf a = low_ones(row0, row1), b = high_ones(row0, row1);
  const vf c = low_ones(row2, row3), d = high_ones(row2, row3);
  return {low_pairs(a, c), high_pairs(a, c), low_pairs(b, d)};
}
DEFORM_INLINE void store_rows(const Three &f, float *out) {
  const vf zero = {};
  const vf a = low_ones(f.x, f.y), b = high_ones(f.x, f.y);
  const vf c = low_ones(f.z, zero), d = high_ones(f.z, zero);
  *reinterpret_cast<vf *>(out) = low_pairs(a, c);
  *reinterpret_cast<vf *>(out + kLanes) = high_pairs(a, c);
  *reinterpret_cast<vf *>(out + 2 * kLanes) = low_pairs(b, d);
  *reinterpret_cast<vf *>(out + 3 * kLanes) = high_pairs(b, d);
}
// Of lane 4 g + k, from what store_rows left.
DEFORM_INLINE v4 row_of(const float *out, uint32_t g, uint32_t k) {
  return load4_single(out + kLanes * k + 4 * g);
}
DEFORM_INLINE Three metres(const Three &whole, float unit) {
  return {__builtin_convertvector((vi)whole.x, vf) * unit, __builtin_convertvector((vi)whole.y, vf) * unit,
          __builtin_convertvector((vi)whole.z, vf) * unit};
}

// Of a point by four times its number, which is an address beside that of the first without a shift.
DEFORM_INLINE const __m128i *place(const SingleBlock &b, uint32_t n4) {
  return reinterpret_cast<const __m128i *>(reinterpret_cast<const double *>(b.at) + n4);
}
DEFORM_INLINE const __m128i *velocity(const SingleBlock &b, uint32_t n4) { return place(b, n4) + 1; }
DEFORM_INLINE void add_at(double *f, uint32_t n4, v4 a) { store4(f + n4, load4(f + n4) + a); }
DEFORM_INLINE void take_at(double *f, uint32_t n4, v4 a) { store4(f + n4, load4(f + n4) - a); }

// 2^power as bits, of a power that is normal.
DEFORM_INLINE double power_of_two(int power) {
  const uint64_t bits = uint64_t(power + 1023) << 52;
  double out;
  __builtin_memcpy(&out, &bits, sizeof out);
  return out;
}

// The origin is the block's first point, so that a block that moves as one keeps its digits. Half of the
// range of an int32 is used: differences of two places fit.
static inline float load_points(const SingleBlock &b, const double *x, const double *v, uint32_t stride) {
  const auto of = [&](const double *all_points, uint32_t n) __attribute__((always_inline)) {
    return load_xyz(all_points + size_t(stride) * b.point[n]);
  };
  const v4 origin = of(x, 0);
  v4 most = splat(0), unsound = splat(0);
  for (uint32_t n = 0; n < b.local; ++n) {
    const v4 a = of(x, n) - origin;
    store4(reinterpret_cast<double *>(b.at + n), a);
    most = max4(most, abs4(a));
    unsound = unsound + (a - a);
  }
  alignas(32) double far[4], bad[4];
  store4(far, most);
  store4(bad, unsound);
  double largest = far[0] > far[1] ? far[0] : far[1];
  largest = largest > far[2] ? largest : far[2];
  uint64_t bits;
  __builtin_memcpy(&bits, &largest, sizeof bits);
  int above = int(bits >> 52) - 1022;  // largest < 2^above
  above = above < -90 ? -90 : above;
  const bool sound = (bad[0] + bad[1]) + bad[2] == 0 && above < 120;
  const v4 scale = splat(sound ? power_of_two(30 - above) : 0);
  const v4 drift = v ? of(v, 0) : splat(0);
  for (uint32_t n = 0; n < b.local; ++n) {
    const v4 a = load4(reinterpret_cast<const double *>(b.at + n));
    store4_whole(b.at[n].x, a * scale);
    if (v) store4_single(b.at[n].v, of(v, n) - drift);
    store4(b.f + 4 * size_t(n), splat(0));
  }
  return sound ? float(power_of_two(above - 30)) : __builtin_nanf("");
}

// (L - L0)/L + damp (dv.d)/L^2 over one denominator, with L - L0 = (L^2 - L0^2)/(L + L0): what roots and
// quotients round is then a share of the stretch.
template <bool kTilts, Damping kDamping>
static inline void springs(const SingleBlock &b, float unit, float damp) {
  alignas(64) float out[4 * kLanes];
  for (uint32_t n = 0; n < b.quads; n += kGroups) {
    const SingleQuad *q = b.quad + n;
    const auto ends = [&](auto at, uint32_t k) __attribute__((always_inline)) {
      return groups([&](uint32_t g) __attribute__((always_inline)) { return at(q[g].j[k]); });
    };
    const auto starts = [&](auto at) __attribute__((always_inline)) {
      return groups([&](uint32_t g) __attribute__((always_inline)) { return at(q[g].i); });
    };
    const auto at_place = [&](uint32_t p) __attribute__((always_inline)) { return place(b, p); };
    const vi own = starts(at_place);
    const Three d = metres(columns(between(own, ends(at_place, 0)), between(own, ends(at_place, 1)),
                                   between(own, ends(at_place, 2)), between(own, ends(at_place, 3))),
                           unit);
    const vf dd = dot(d, d);
    const vf counted = kTilts ? dd + load(b.tilt + 4 * size_t(n)) : dd;
    const vf rest = load(b.rest + 4 * size_t(n)), length = root(counted), sum = length + rest;
    vf stretch = (counted - load(b.rest_square + 4 * size_t(n))) * length;
    if constexpr (kDamping != kUndamped) {
      const auto at_velocity = [&](uint32_t p) __attribute__((always_inline)) { return velocity(b, p); };
      const vf moves = (vf)starts(at_velocity);
      const Three rate = columns((vf)ends(at_velocity, 0) - moves, (vf)ends(at_velocity, 1) - moves,
                                 (vf)ends(at_velocity, 2) - moves, (vf)ends(at_velocity, 3) - moves);
      const vf factor = kDamping == kPerSpring ? load(b.damp + 4 * size_t(n)) : all(damp);
      stretch = stretch + (factor * dot(rate, d)) * sum;
    }
    vf scale = load(b.stiffness + 4 * size_t(n)) * (stretch / (counted * sum));
    scale = dd <= kShortestSingle ? vf{} : scale;
    store_rows(scale * d, out);
    double *const f = b.f;
#pragma GCC unroll 4
    for (uint32_t g = 0; g < kGroups; ++g) {
      const v4 f0 = row_of(out, g, 0), f1 = row_of(out, g, 1), f2 = row_of(out, g, 2), f3 = row_of(out, g, 3);
      add_at(f, q[g].i, (f0 + f1) + (f2 + f3));
      take_at(f, q[g].j[0], f0);
      take_at(f, q[g].j[1], f1);
      take_at(f, q[g].j[2], f2);
      take_at(f, q[g].j[3], f3);
    }
  }
}

DEFORM_INLINE vf pressure_of(const SingleBlock &b, uint32_t t, vf now) {
  const vf rest = load(b.volume6 + t);
  now = smaller(larger(now, float(kLeastVolume) * rest), float(kMostVolume) * rest);
  return load(b.bulk + t) * (rest - now) +
         load(b.collapse + t) * larger(float(kCollapseBelow) * rest - now, vf{});
}

// As the one of msm_kernel_quad.h: a lane that is within its limit gets pressure * g.
DEFORM_INLINE void stretched_forces(const SingleBlock &b, uint32_t t, vf q, vf now, const Three &e1,
                                    const Three &e2, const Three &e3, Three &g1, Three &g2, Three &g3) {
  const vf limit = load(b.limit + t), most = larger(q, limit), u = limit / most, power = root(u) * u;
  const vf by_q = -3.75f * (power * (1.0f - u)) / most, share = power * (2.5f - 1.5f * u);
  const vf p = pressure_of(b, t, now * share), along = p * share, inward = (8.0f * p) * (now * by_q);
  const Three middle = all(0.25f) * ((e1 + e2) + e3);
  g1 = along * g1 + inward * (e1 - middle);
  g2 = along * g2 + inward * (e2 - middle);
  g3 = along * g3 + inward * (e3 - middle);
}

static inline void volume_cells(const SingleBlock &b, float unit) {
  alignas(64) float f1[4 * kLanes], f2[4 * kLanes], f3[4 * kLanes];
  for (uint32_t t = 0; t < b.cells; t += kLanes) {
    const SingleCell *c = b.cell + t;
    const auto corner = [&](uint32_t k, uint32_t n) __attribute__((always_inline)) {
      return groups([&](uint32_t g) __attribute__((always_inline)) { return place(b, c[4 * g + k].p[n]); });
    };
    const vi o0 = corner(0, 0), o1 = corner(1, 0), o2 = corner(2, 0), o3 = corner(3, 0);
    const auto edge = [&](uint32_t n) __attribute__((always_inline)) {
      return metres(columns(between(o0, corner(0, n)), between(o1, corner(1, n)), between(o2, corner(2, n)),
                            between(o3, corner(3, n))),
                    unit);
    };
    const Three e1 = edge(1), e2 = edge(2), e3 = edge(3);
    Three g1 = cross(e2, e3), g2 = cross(e3, e1), g3 = cross(e1, e2);
    const vf now = dot(e1, g1);
    const Three sum = (e1 + e2) + e3;
    const vf q = 4.0f * ((dot(e1, e1) + dot(e2, e2)) + dot(e3, e3)) - dot(sum, sum);
    if (any(q > load(b.limit + t))) {
      stretched_forces(b, t, q, now, e1, e2, e3, g1, g2, g3);
    } else {
      const vf pressure = pressure_of(b, t, now);
      if (!any(pressure != vf{})) continue;
      g1 = pressure * g1;
      g2 = pressure * g2;
      g3 = pressure * g3;
    }
    store_rows(g1, f1);
    store_rows(g2, f2);
    store_rows(g3, f3);
    double *const f = b.f;
#pragma GCC unroll 4
    for (uint32_t g = 0; g < kGroups; ++g)
#pragma GCC unroll 4
      for (uint32_t k = 0; k < 4; ++k) {
        const uint16_t *p = c[4 * g + k].p;
        const v4 a = row_of(f1, g, k), d = row_of(f2, g, k), h = row_of(f3, g, k);
        add_at(f, p[1], a);
        add_at(f, p[2], d);
        add_at(f, p[3], h);
        take_at(f, p[0], (a + d) + h);
      }
  }
}

constexpr SingleKernels kKernels = {
    load_points,
    {{springs<false, kUndamped>, springs<false, kUniform>, springs<false, kPerSpring>},
     {springs<true, kUndamped>, springs<true, kUniform>, springs<true, kPerSpring>}},
    volume_cells};

}  // namespace single
}  // namespace
}  // namespace msm
