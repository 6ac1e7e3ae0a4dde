// Kernel functions for the points of a block, for files that define `v4` and its operations (lanes_avx.h,
// lanes_sse2.h). Internal linkage only.
#pragma once
#include <stddef.h>

#include "block_points.h"

namespace lanes {
namespace {

using model::BlockPoints;
using model::Merge;

// `v4` for templates that serve other vectors and single numbers, too.
struct Wide {
  typedef v4 V;
  DEFORM_INLINE v4 splat(double a) { return lanes::splat(a); }
  DEFORM_INLINE v4 root(v4 a) { return sqrt4(a); }
  DEFORM_INLINE v4 more(v4 a, v4 b) { return max4(a, b); }
  DEFORM_INLINE v4 less(v4 a, v4 b) { return min4(a, b); }
};

DEFORM_INLINE v4 point4(const BlockPoints &b, uint32_t n) { return load4(b.p + 8 * size_t(n)); }
DEFORM_INLINE v4 velocity4(const BlockPoints &b, uint32_t n) { return load4(b.p + 8 * size_t(n) + 4); }
DEFORM_INLINE void add_to(const BlockPoints &b, uint32_t n, v4 a) {
  double *f = b.f + 4 * size_t(n);
  store4(f, load4(f) + a);
}

// Prefetches the cache line of p, which may lie behind the end of an array.
DEFORM_INLINE void fetch(const void *p) { __builtin_prefetch(p); }

// one(n) for all points of the block that is loaded, while points further on are prefetched: near its end
// those of the next block, since the lists of points, and the sums, of all blocks lie end to end.
template <class One>
DEFORM_INLINE void each_loaded(const BlockPoints &b, const double *x, const double *v, uint32_t stride,
                               const One &one) {
  if (!b.ahead) {
    for (uint32_t n = 0; n < b.local; ++n) one(n);
    return;
  }
  for (uint32_t n = 0; n < b.local; ++n) {
    const size_t next = size_t(stride) * b.point[n + b.ahead];
    fetch(x + next);
    if (v) fetch(v + next);
    fetch(b.f + 4 * size_t(n + b.ahead));
    one(n);
  }
}

// Copies x (and v, unless NULL) of the block's points in and clears f.
static inline void load_block(const BlockPoints &b, const double *x, const double *v, uint32_t stride) {
  each_loaded(b, x, v, stride, [&](uint32_t n) __attribute__((always_inline)) {
    const size_t at = size_t(stride) * b.point[n];
    store4(b.p + 8 * size_t(n), load_xyz(x + at));
    if (v) store4(b.p + 8 * size_t(n) + 4, load_xyz(v + at));
    store4(b.f + 4 * size_t(n), splat(0));
  });
}

template <int kLanes>
DEFORM_INLINE void merge_lanes(double *sums, const Merge *merge, uint32_t n) {
  for (uint32_t m = 0; m < n; ++m)
    for (int k = 0; k < kLanes; k += 4) {
      double *to = sums + kLanes * size_t(merge[m].to) + k;
      store4(to, load4(to) + load4(sums + kLanes * size_t(merge[m].from) + k));
    }
}
static inline void merge_halo(double *f, const Merge *merge, uint32_t n) { merge_lanes<4>(f, merge, n); }

// Adds the owned points' forces to the host's.
static inline void add_to_host(const BlockPoints &b, double *f, uint32_t stride) {
  for (uint32_t n = 0; n < b.owned; ++n) {
    double *out = f + size_t(stride) * b.point[n];
    const double *sum = b.f + 4 * size_t(n);
    _mm_storeu_pd(out, _mm_add_pd(_mm_loadu_pd(out), _mm_load_pd(sum)));
    out[2] += sum[2];
  }
}

}  // namespace
}  // namespace lanes
