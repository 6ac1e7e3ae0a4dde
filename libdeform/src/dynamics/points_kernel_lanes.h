// The loops of points_kernel.h for vectors of kWidth (2 or 4) doubles, which the including file defines.
#pragma once
#include <stddef.h>

#include "math/kernel_vector.h"
#include "points_kernel.h"

namespace dfm {
namespace {

constexpr uint32_t kParts = 4 / kWidth;  // vectors that hold a point

// index(k): the number of point k; fetch(k): prefetches its memory; force(k, at, p): vector p of its force,
// which lies at `at` in arrays of all.
template <class Index, class Fetch, class Force>
DEFORM_INLINE double move_freely(const FreeMotion &m, uint32_t n, const Index &index, const Fetch &fetch,
                                 const Force &force) {
  const Vector step = splat(m.h), none = {};
  Vector g[kParts], square[2][kParts] = {};  // two sums, so that one addition does not wait for the other
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) g[p] = load(m.gravity + p * kWidth);
  const auto one = [&](uint32_t k, uint32_t sum) __attribute__((always_inline)) {
    const size_t i = index(k);
    const Vector mass = splat(m.mass[i]);
    DEFORM_UNROLL
    for (uint32_t p = 0; p < kParts; ++p) {
      const size_t at = 4 * i + p * kWidth;
      // none: +0 of -0, as an impulse of zero would make it
      const Vector u = (load(m.v + at) + step * (load(m.w + at) * (force(k, at, p) + mass * g[p]))) + none;
      store(m.free + at, u);
      store(m.x_end + at, load(m.x + at) + step * u);
      square[sum][p] += mass * (u * u);
    }
  };
  uint32_t k = 0;
  for (; k + 2 + m.ahead <= n; k += 2) {
    fetch(k + m.ahead);
    fetch(k + 1 + m.ahead);
    one(k, 0);
    one(k + 1, 1);
  }
  for (; k + 2 <= n; k += 2) {
    one(k, 0);
    one(k + 1, 1);
  }
  if (k < n) one(k, 0);
  double sum[4];
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) store(sum + p * kWidth, square[0][p] + square[1][p]);
  return 0.5 * ((sum[0] + sum[1]) + sum[2]);
}

double predict(const FreeMotion &m, uint32_t n, const double *f) {
  return move_freely(
      m, n, [](uint32_t k) __attribute__((always_inline)) { return size_t(k); },
      [](uint32_t) __attribute__((always_inline)) {},
      [&](uint32_t, size_t at, uint32_t) __attribute__((always_inline)) { return load(f + at); });
}

double predict_part(const FreeMotion &m, uint32_t n, const uint32_t *point, const double *loads,
                    const double *more) {
  const auto fetch = [&](uint32_t k) __attribute__((always_inline)) {
    const size_t at = 4 * size_t(point[k]);
    __builtin_prefetch(m.v + at);
    __builtin_prefetch(m.w + at);
    __builtin_prefetch(m.x + at);
    __builtin_prefetch(loads + at);
    __builtin_prefetch(m.free + at, 1);
    __builtin_prefetch(m.x_end + at, 1);
  };
  return move_freely(
      m, n, [&](uint32_t k) __attribute__((always_inline)) { return size_t(point[k]); }, fetch,
      [&](uint32_t k, size_t at, uint32_t p) __attribute__((always_inline)) {
        return load(loads + at) + load(more + 4 * size_t(k) + p * kWidth);
      });
}

void end(uint32_t n, double h, const double *x, const double *free, const double *w, const double *impulse,
         double *x_end, double *v_end) {
  const Vector step = splat(h);
  if (impulse) {
    for (size_t at = 0; at < 4 * size_t(n); at += kWidth) {
      const Vector u = load(free + at) + load(w + at) * load(impulse + at);
      store(v_end + at, u);
      store(x_end + at, load(x + at) + step * u);
    }
    return;
  }
  for (size_t at = 0; at < 4 * size_t(n); at += kWidth) {
    const Vector u = load(free + at);
    store(v_end + at, u);
    store(x_end + at, load(x + at) + step * u);
  }
}

// Component by component, of kWidth points or differences; part(k, p): vector p of lane k.
template <class V>
struct Columns {
  V x, y, z;
};
template <class V, class Part>
DEFORM_INLINE Columns<V> columns(const Part &part) {
  if constexpr (kWidth == 4) {
    const V p = part(0, 0), q = part(1, 0), r = part(2, 0), s = part(3, 0);
    const V a = __builtin_shufflevector(p, q, 0, 4, 2, 6), b = __builtin_shufflevector(p, q, 1, 5, 3, 7);
    const V c = __builtin_shufflevector(r, s, 0, 4, 2, 6), d = __builtin_shufflevector(r, s, 1, 5, 3, 7);
    return {__builtin_shufflevector(a, c, 0, 1, 4, 5), __builtin_shufflevector(b, d, 0, 1, 4, 5),
            __builtin_shufflevector(a, c, 2, 3, 6, 7)};
  } else {
    const V p = part(0, 0), q = part(1, 0);
    return {__builtin_shufflevector(p, q, 0, 2), __builtin_shufflevector(p, q, 1, 3),
            __builtin_shufflevector(part(0, 1), part(1, 1), 0, 2)};
  }
}
// of `to` less `from`, four doubles each; to(k), from(k): those of lane k
template <class To, class From>
DEFORM_INLINE Columns<Vector> differences(const To &to, const From &from) {
  return columns<Vector>([&](uint32_t k, uint32_t p) __attribute__((always_inline)) {
    return load(to(k) + p * kWidth) - load(from(k) + p * kWidth);
  });
}
DEFORM_INLINE Vector dot(const Columns<Vector> &a, const Columns<Vector> &b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}

typedef long long Mask __attribute__((vector_size(8 * kWidth)));

// use(at, real): of n rows kWidth at a time, at(k) the row of lane k; lanes that are not real have the last
// row again
template <class Use>
DEFORM_INLINE void each_lane(uint32_t n, const Use &use) {
  uint32_t t = 0;
  for (; t + kWidth <= n; t += kWidth)
    use([&](uint32_t k) __attribute__((always_inline)) { return size_t(t) + k; }, ~Mask{});
  if (t == n) return;
  Mask real = {};
  for (uint32_t k = 0; k < n - t; ++k) real[k] = -1;
  use([&](uint32_t k) __attribute__((always_inline)) { return size_t(t + k < n ? t + k : n - 1); }, real);
}

uint32_t inverted(uint32_t n, const uint32_t *cells, const double *x) {
  Mask found = {};
  each_lane(n, [&](const auto &cell, Mask real) __attribute__((always_inline)) {
    const auto corner = [&](uint32_t c) __attribute__((always_inline)) {
      return [=](uint32_t k)
                 __attribute__((always_inline)) { return x + 4 * size_t(cells[4 * cell(k) + c]); };
    };
    const auto a = differences(corner(1), corner(0)), b = differences(corner(2), corner(0));
    const auto c = differences(corner(3), corner(0));
    const Columns<Vector> normal = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    found -= real & (dot(normal, c) < Vector{});
  });
  uint32_t sum = 0;
  for (uint32_t k = 0; k < kWidth; ++k) sum += uint32_t(found[k]);
  return sum;
}

double largest_box(uint32_t n, const uint32_t *cells, const double *x) {
  double most = 0;
  for (uint32_t c = 0; c < n; ++c) {
    const uint32_t *const corner = cells + 4 * size_t(c);
    double square[4];
    DEFORM_UNROLL
    for (uint32_t p = 0; p < kParts; ++p) {
      const auto at = [&](uint32_t k) __attribute__((always_inline)) {
        return load(x + 4 * size_t(corner[k]) + p * kWidth);
      };
      const Vector a = at(0), b = at(1), e = at(2), f = at(3);
      const Vector low1 = b < a ? b : a, low2 = f < e ? f : e, high1 = a < b ? b : a, high2 = e < f ? f : e;
      const Vector low = low2 < low1 ? low2 : low1, high = high1 < high2 ? high2 : high1;
      const Vector side = high - low, two = side * side;
      for (uint32_t k = 0; k < kWidth; ++k) square[p * kWidth + k] = two[k];
    }
    const double sum = (square[0] + square[1]) + square[2];
    most = most < sum ? sum : most;
  }
  return most;
}

void bounds(uint32_t n, const double *x, double low[4], double high[4]) {
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) {
    Vector least = load(x + p * kWidth), most = least;
    for (uint32_t i = 1; i < n; ++i) {
      const Vector at = load(x + 4 * size_t(i) + p * kWidth);
      least = at < least ? at : least;
      most = most < at ? at : most;
    }
    store(low + p * kWidth, least);
    store(high + p * kWidth, most);
  }
}

void middles(uint32_t n, const uint32_t *cells, const uint32_t *tets, const double *x, double *out) {
  const Vector quarter = splat(0.25);
  for (uint32_t c = 0; c < n; ++c, out += 4) {
    const uint32_t *const corner = tets + 4 * size_t(cells[c]);
    DEFORM_UNROLL
    for (uint32_t p = 0; p < kParts; ++p) {
      const auto at = [&](uint32_t k) __attribute__((always_inline)) {
        return load(x + 4 * size_t(corner[k]) + p * kWidth);
      };
      store(out + p * kWidth, quarter * ((at(0) + at(1)) + (at(2) + at(3))));
    }
  }
}

double farthest(uint32_t n, const uint32_t *pairs, const double *x) {
  Vector most = {};
  each_lane(n, [&](const auto &pair, Mask) __attribute__((always_inline)) {
    const auto end = [&](uint32_t side) __attribute__((always_inline)) {
      return [=](uint32_t k)
                 __attribute__((always_inline)) { return x + 4 * size_t(pairs[2 * pair(k) + side]); };
    };
    const auto d = differences(end(0), end(1));
    const Vector square = dot(d, d);
    most = square > most ? square : most;
  });
  double out = 0;
  for (uint32_t k = 0; k < kWidth; ++k) out = most[k] > out ? most[k] : out;
  return out;
}

double strain_rate(uint32_t n, const uint32_t *edges, const double *x, const double *v) {
  Vector most = {};
  each_lane(n, [&](const auto &edge, Mask) __attribute__((always_inline)) {
    const auto end = [&](const double *of, uint32_t side) __attribute__((always_inline)) {
      return [=](uint32_t k)
                 __attribute__((always_inline)) { return of + 4 * size_t(edges[2 * edge(k) + side]); };
    };
    const auto d = differences(end(x, 1), end(x, 0));
    const Vector stretch = dot(d, differences(end(v, 1), end(v, 0)));
    const Vector rate = (stretch < Vector{} ? -stretch : stretch) / dot(d, d);
    most = rate > most ? rate : most;  // NaN if both ends coincide
  });
  double out = 0;
  for (uint32_t k = 0; k < kWidth; ++k) out = most[k] > out ? most[k] : out;
  return out;
}

constexpr PointsKernels kKernels = {predict, predict_part, end,      inverted,   largest_box,
                                    bounds,  middles,      farthest, strain_rate};

}  // namespace
}  // namespace dfm
