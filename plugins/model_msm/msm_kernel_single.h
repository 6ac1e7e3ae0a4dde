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

struct Floats {
  typedef vf V;
  DEFORM_INLINE vf splat(double a) { return vf{} + float(a); }
  DEFORM_INLINE vf load(const float *p) { return *reinterpret_cast<const vf *>(p); }
  DEFORM_INLINE vf root(vf a) { return single::root(a); }
  DEFORM_INLINE vf more(vf a, vf b) { return a > b ? a : b; }
  DEFORM_INLINE vf less(vf a, vf b) { return a < b ? a : b; }
  DEFORM_INLINE bool any_above(vf a, vf limit) { return any(a > limit); }
};
typedef msm::Three<Floats> Three;

// Bits of to - from, of fixed-point places. One that is not finite is the least integer, and the difference
// wraps: the force is no number then, whatever the bits.
typedef uint32_t vu __attribute__((vector_size(4 * DEFORM_LANES)));
DEFORM_INLINE vf between(vi from, vi to) { return (vf)((vu)to - (vu)from); }

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
// The row of lane 4 g + k, from what store_rows left.
DEFORM_INLINE v4 row_of(const float *out, uint32_t g, uint32_t k) {
  return load4_single(out + kLanes * k + 4 * g);
}
DEFORM_INLINE Three metres(const Three &whole, float unit) {
  return {__builtin_convertvector((vi)whole.x, vf) * unit, __builtin_convertvector((vi)whole.y, vf) * unit,
          __builtin_convertvector((vi)whole.z, vf) * unit};
}

// The place of a point by four times its number, which is an address beside that of the first without a
// shift.
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
// range of an int32 is used: differences of two places fit. The unit is known when all points have been seen;
// it is nearly always that of the last call, so they are stored by that one at once.
static inline float load_points(const SingleBlock &b, const double *x, const double *v, uint32_t stride) {
  const auto of = [&](const double *all_points, uint32_t n) __attribute__((always_inline)) {
    return load_xyz(all_points + size_t(stride) * b.point[n]);
  };
  const v4 origin = of(x, 0), drift = v ? of(v, 0) : splat(0);
  v4 most = splat(0), unsound = splat(0);
  const v4 guess = splat(power_of_two(30 - *b.above));
  each_loaded(b, x, v, stride, [&](uint32_t n) __attribute__((always_inline)) {
    const v4 a = of(x, n) - origin;
    store4_whole(b.at[n].x, a * guess);
    most = max4(most, abs4(a));
    unsound = unsound + (a - a);
    if (v) store4_single(b.at[n].v, of(v, n) - drift);
    store4(b.f + 4 * size_t(n), splat(0));
  });
  alignas(32) double far[4], bad[4];
  store4(far, most);
  store4(bad, unsound);
  double largest = far[0] > far[1] ? far[0] : far[1];
  largest = largest > far[2] ? largest : far[2];
  uint64_t bits;
  __builtin_memcpy(&bits, &largest, sizeof bits);
  int above = int(bits >> 52) - 1022;  // largest < 2^above
  above = above < -90 ? -90 : above;
  const bool valid = (bad[0] + bad[1]) + bad[2] == 0 && above < 120;
  if (!valid || above != *b.above) {
    const v4 scale = splat(valid ? power_of_two(30 - above) : 0);
    for (uint32_t n = 0; n < b.local; ++n) store4_whole(b.at[n].x, (of(x, n) - origin) * scale);
    *b.above = valid ? above : 0;
  }
  return valid ? float(power_of_two(above - 30)) : __builtin_nanf("");
}

// Force over d = to - from on `from`: (L - L0)/L + damp (dv.d)/L^2 over one denominator, with L - L0 = (L^2 -
// L0^2)/(L + L0). What roots and quotients round is then a share of the stretch.
template <bool kTilts, Damping kDamping>
DEFORM_INLINE vf pull(const SingleBlock &s, size_t slot, vf dd, vf rate, float damp) {
  const vf counted = kTilts ? dd + Floats::load(s.tilt + slot) : dd;
  const vf rest = Floats::load(s.rest + slot), length = root(counted), sum = length + rest;
  vf stretch = (counted - rest * rest) * length;
  if constexpr (kDamping != kUndamped) {
    const vf factor = kDamping == kPerSpring ? Floats::load(s.damp + slot) : vf{} + damp;
    stretch = stretch + (factor * rate) * sum;
  }
  const vf scale = Floats::load(s.stiffness + slot) * (stretch / (counted * sum));
  return dd <= kShortestSingle ? vf{} : scale;
}

// One point of each lane's fan less a, in units and in m/s.
struct Ray { Three whole, rate; };

// A fan's forces are sums in floats at b and at each ring point; what a gets is their sum in double with the
// other sign, so the momentum is kept as exactly as by forces in pairs.
template <bool kTilts, Damping kDamping, bool kCells>
static inline void fans(const SingleBlock &b, float unit, float damp) {
  alignas(64) float out[4 * kLanes * (kMaxInFan + 2)];  // b, then the ring
  const uint16_t *number = b.number;
  size_t ray_at = 0, cell_at = 0;
  for (uint32_t n = 0; n < b.groups; ++n) {
    const uint32_t cells = b.cells[n];
    for (uint32_t half = 0; half < kFans; half += kLanes) {
      const auto fetch = [&](uint32_t p, uint32_t k, auto at) __attribute__((always_inline)) {
        const uint16_t *i = number + kFans * p + half + k;
        return groups([&](uint32_t g) __attribute__((always_inline)) { return at(i[4 * g]); });
      };
      const auto at_place = [&](uint32_t p) __attribute__((always_inline)) { return place(b, p); };
      const auto at_velocity = [&](uint32_t p) __attribute__((always_inline)) { return velocity(b, p); };
      const vi o0 = fetch(0, 0, at_place), o1 = fetch(0, 1, at_place);
      const vi o2 = fetch(0, 2, at_place), o3 = fetch(0, 3, at_place);
      vf v0, v1, v2, v3;
      if constexpr (kDamping != kUndamped) {
        v0 = (vf)fetch(0, 0, at_velocity);
        v1 = (vf)fetch(0, 1, at_velocity);
        v2 = (vf)fetch(0, 2, at_velocity);
        v3 = (vf)fetch(0, 3, at_velocity);
      }
      const auto ray_to = [&](uint32_t p) __attribute__((always_inline)) {
        Ray r;
        r.whole = columns(between(o0, fetch(p, 0, at_place)), between(o1, fetch(p, 1, at_place)),
                          between(o2, fetch(p, 2, at_place)), between(o3, fetch(p, 3, at_place)));
        if constexpr (kDamping != kUndamped)
          r.rate = columns((vf)fetch(p, 0, at_velocity) - v0, (vf)fetch(p, 1, at_velocity) - v1,
                           (vf)fetch(p, 2, at_velocity) - v2, (vf)fetch(p, 3, at_velocity) - v3);
        return r;
      };
      const auto rate_of = [](const Three &rate, const Three &d) __attribute__((always_inline)) {
        if constexpr (kDamping == kUndamped) return vf{};
        else return dot(rate, d);
      };
      const Three zero = {};
      const Ray axis = ray_to(1);
      const Three e1 = metres(axis.whole, unit);
      const vf square1 = dot(e1, e1);
      const size_t slot = ray_at + half, cell = cell_at + half;
      Three at_b = zero - pull<kTilts, kDamping>(b, slot, square1, rate_of(axis.rate, e1), damp) * e1;
      // The points of the ring one after another: e2, normal2 and at_ring are of the one before.
      const auto ring_point = [&](uint32_t k, Three &e, vf &square) __attribute__((always_inline)) {
        const Ray ray = ray_to(2 + k);
        e = metres(ray.whole, unit);
        square = dot(e, e);
        return zero -
               pull<kTilts, kDamping>(b, slot + kFans * (1 + size_t(k)), square, rate_of(ray.rate, e), damp) *
                   e;
      };
      Three e2, normal2 = zero;
      vf square2;
      Three at_ring = ring_point(0, e2, square2);
      if constexpr (kCells) normal2 = cross(e1, e2);
      for (uint32_t k = 1; k <= cells; ++k) {
        Three e3;
        vf square3;
        Three here = ring_point(k, e3, square3);
        if constexpr (kCells) {
          const Three normal3 = cross(e1, e3);
          const size_t t = cell + kFans * (k - 1);
          Cells<Floats> c = {e1, e2, e3, cross(e2, e3), zero - normal3, normal2};
          const vf now = dot(e1, c.g1);
          const Three sum = (e1 + e2) + e3;
          const vf q = 4.0f * ((square1 + square2) + square3) - dot(sum, sum);
          if (any(q > Floats::load(b.limit + t))) {
            stretched_forces(b, t, q, now, c);
          } else {
            const vf pressure = pressure_of<Floats>(b, t, now);
            c.g1 = pressure * c.g1;
            c.g2 = pressure * c.g2;
            c.g3 = pressure * c.g3;
          }
          at_b = at_b + c.g1;
          at_ring = at_ring + c.g2;
          here = here + c.g3;
          e2 = e3;
          square2 = square3;
          normal2 = normal3;
        }
        store_rows(at_ring, out + 4 * kLanes * k);
        at_ring = here;
      }
      store_rows(at_ring, out + 4 * kLanes * (cells + 1));
      store_rows(at_b, out);
      double *const f = b.f;
#pragma GCC unroll 4
      for (uint32_t g = 0; g < kGroups; ++g) {
        const uint16_t *i = number + half + 4 * g;
        v4 a0 = splat(0), a1 = a0, a2 = a0, a3 = a0;
        for (uint32_t p = 0; p < cells + 2; ++p) {
          const float *row = out + 4 * kLanes * p;
          const uint16_t *j = i + kFans * (p + 1);
          const v4 f0 = row_of(row, g, 0), f1 = row_of(row, g, 1), f2 = row_of(row, g, 2),
                   f3 = row_of(row, g, 3);
          add_at(f, j[0], f0);
          add_at(f, j[1], f1);
          add_at(f, j[2], f2);
          add_at(f, j[3], f3);
          a0 = a0 + f0;
          a1 = a1 + f1;
          a2 = a2 + f2;
          a3 = a3 + f3;
        }
        take_at(f, i[0], a0);
        take_at(f, i[1], a1);
        take_at(f, i[2], a2);
        take_at(f, i[3], a3);
      }
    }
    number += kFans * (cells + 3);
    ray_at += kFans * (size_t(cells) + 2);
    cell_at += kFans * size_t(cells);
  }
}

#define MSM_FANS(t, d) {fans<t, d, false>, fans<t, d, true>}
#define MSM_DAMPED(t) {MSM_FANS(t, kUndamped), MSM_FANS(t, kUniform), MSM_FANS(t, kPerSpring)}
constexpr SingleKernels kKernels = {load_points, {MSM_DAMPED(false), MSM_DAMPED(true)}};
#undef MSM_DAMPED
#undef MSM_FANS

}  // namespace single
}  // namespace
}  // namespace msm
