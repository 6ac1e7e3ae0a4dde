// Kernels on vectors of four doubles, for the files that offer `sqrt4`: the compiler splits them in two for SSE2.
// Everything here has internal linkage (see house rules on wide kernels).
#pragma once
#include <stddef.h>

#include "msm_kernel.h"

namespace msm {
namespace {

typedef double v4 __attribute__((vector_size(32)));
typedef double v4u __attribute__((vector_size(32), aligned(8)));
typedef int64_t m4 __attribute__((vector_size(32)));

#define MSM_INLINE static inline __attribute__((always_inline))

MSM_INLINE void sqrt4(v4 &a);

MSM_INLINE const v4 &at4(const double *p) { return *reinterpret_cast<const v4 *>(p); }
MSM_INLINE v4 &at4(double *p) { return *reinterpret_cast<v4 *>(p); }

// out[k] = (s_k.x + s_k.y) + (s_k.z + s_k.w)
MSM_INLINE void sum_rows(const v4 &s0, const v4 &s1, const v4 &s2, const v4 &s3, v4 &out) {
  const v4 a = __builtin_shufflevector(s0, s1, 0, 4, 2, 6) + __builtin_shufflevector(s0, s1, 1, 5, 3, 7);
  const v4 b = __builtin_shufflevector(s2, s3, 0, 4, 2, 6) + __builtin_shufflevector(s2, s3, 1, 5, 3, 7);
  out = __builtin_shufflevector(a, b, 0, 1, 4, 5) + __builtin_shufflevector(a, b, 2, 3, 6, 7);
}

MSM_INLINE void transpose(v4 &r0, v4 &r1, v4 &r2, v4 &r3) {
  const v4 a = __builtin_shufflevector(r0, r1, 0, 4, 2, 6), b = __builtin_shufflevector(r0, r1, 1, 5, 3, 7);
  const v4 c = __builtin_shufflevector(r2, r3, 0, 4, 2, 6), d = __builtin_shufflevector(r2, r3, 1, 5, 3, 7);
  r0 = __builtin_shufflevector(a, c, 0, 1, 4, 5), r1 = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  r2 = __builtin_shufflevector(a, c, 2, 3, 6, 7), r3 = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

static void load_block(const Block &b, const double *x, const double *v, uint32_t stride) {
  const m4 xyz = {-1, -1, -1, 0};
  for (uint32_t n = 0; n < b.local; ++n) {
    double *p = b.p + 8 * size_t(n);
    const size_t at = size_t(stride) * b.point[n];
    if (stride >= 4) {  // the fourth lane is the host's: masked, whatever it holds
      at4(p) = (v4)((m4) * reinterpret_cast<const v4u *>(x + at) & xyz);
      if (v) at4(p + 4) = (v4)((m4) * reinterpret_cast<const v4u *>(v + at) & xyz);
    } else {
      at4(p) = v4{x[at], x[at + 1], x[at + 2], 0};
      if (v) at4(p + 4) = v4{v[at], v[at + 1], v[at + 2], 0};
    }
    at4(b.f + 4 * size_t(n)) = v4{};
  }
}

template <bool kDamped>
MSM_INLINE void springs(const Block &b, double damp) {
  for (uint32_t q = 0; q < b.quads; ++q) {
    const Quad &quad = b.quad[q];
    const double *pi = b.p + 8 * size_t(quad.i);
    const double *p0 = b.p + 8 * size_t(quad.j[0]), *p1 = b.p + 8 * size_t(quad.j[1]);
    const double *p2 = b.p + 8 * size_t(quad.j[2]), *p3 = b.p + 8 * size_t(quad.j[3]);
    const v4 xi = at4(pi);
    const v4 d0 = at4(p0) - xi, d1 = at4(p1) - xi, d2 = at4(p2) - xi, d3 = at4(p3) - xi;
    v4 dd, stretch;
    sum_rows(d0 * d0, d1 * d1, d2 * d2, d3 * d3, dd);
    v4 length = dd;
    sqrt4(length);
    const v4 inverse = 1.0 / length;
    stretch = (length - at4(b.rest + 4 * size_t(q))) * inverse;
    if constexpr (kDamped) {
      const v4 vi = at4(pi + 4);
      v4 rate;
      sum_rows(d0 * (at4(p0 + 4) - vi), d1 * (at4(p1 + 4) - vi), d2 * (at4(p2 + 4) - vi), d3 * (at4(p3 + 4) - vi), rate);
      stretch = stretch + damp * ((rate * inverse) * inverse);
    }
    const v4 scale = (v4)((m4)(at4(b.stiffness + 4 * size_t(q)) * stretch) & (m4)(dd > kShortestSquared));
    const v4 f0 = scale[0] * d0, f1 = scale[1] * d1, f2 = scale[2] * d2, f3 = scale[3] * d3;
    at4(b.f + 4 * size_t(quad.i)) += (f0 + f1) + (f2 + f3);
    at4(b.f + 4 * size_t(quad.j[0])) -= f0;
    at4(b.f + 4 * size_t(quad.j[1])) -= f1;
    at4(b.f + 4 * size_t(quad.j[2])) -= f2;
    at4(b.f + 4 * size_t(quad.j[3])) -= f3;
  }
}

static void plain_springs(const Block &b) { springs<false>(b, 0); }
static void damped_springs(const Block &b, double damp) { springs<true>(b, damp); }

static void volume_cells(const Block &b) {
  for (uint32_t t = 0; t < b.cells; t += 4) {
    const Cell *cell = b.cell + t;
    v4 edge[3][4];
    for (int k = 0; k < 4; ++k) {
      const v4 x0 = at4(b.p + 8 * size_t(cell[k].p[0]));
      for (int n = 0; n < 3; ++n) edge[n][k] = at4(b.p + 8 * size_t(cell[k].p[n + 1])) - x0;
    }
    for (int n = 0; n < 3; ++n) transpose(edge[n][0], edge[n][1], edge[n][2], edge[n][3]);
    const v4 *a = edge[0], *c = edge[1], *d = edge[2];
    v4 g[3][4] = {{c[1] * d[2] - c[2] * d[1], c[2] * d[0] - c[0] * d[2], c[0] * d[1] - c[1] * d[0], {}},
                  {d[1] * a[2] - d[2] * a[1], d[2] * a[0] - d[0] * a[2], d[0] * a[1] - d[1] * a[0], {}},
                  {a[1] * c[2] - a[2] * c[1], a[2] * c[0] - a[0] * c[2], a[0] * c[1] - a[1] * c[0], {}}};
    const v4 volume6 = (a[0] * g[0][0] + a[1] * g[0][1]) + a[2] * g[0][2];
    const v4 pressure = at4(b.bulk + t) * (at4(b.volume6 + t) - volume6);
    for (int n = 0; n < 3; ++n) {
      for (int k = 0; k < 3; ++k) g[n][k] = pressure * g[n][k];
      transpose(g[n][0], g[n][1], g[n][2], g[n][3]);
    }
    for (int k = 0; k < 4; ++k) {
      at4(b.f + 4 * size_t(cell[k].p[0])) -= (g[0][k] + g[1][k]) + g[2][k];
      for (int n = 0; n < 3; ++n) at4(b.f + 4 * size_t(cell[k].p[n + 1])) += g[n][k];
    }
  }
}

}  // namespace
}  // namespace msm
