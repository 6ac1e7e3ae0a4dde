// The plain kernels on four lanes, for the files that bring v4 (see
// plugins/model_common/lanes_avx.h).
#pragma once
#include <stddef.h>

#include "msm_bound.h"

namespace bound {
namespace {

using namespace lanes;

// Component arrays are read with gather instructions where there are any (gather4), four loads elsewhere.
DEFORM_INLINE v4 scale_of(v4 dd, v4 rate, v4 stiffness, v4 rest, double damp) {
  const v4 length = sqrt4(dd), inverse = splat(1.0) / length;
  const v4 stretch = (length - rest) * inverse + splat(damp) * ((rate * inverse) * inverse);
  return zero_unless_above(stiffness * stretch, dd, splat(1e-200));
}

template <int kStride>
DEFORM_INLINE v4 get(const double *a, uint32_t n) {
  if constexpr (kStride == 4) return load4(a + 4 * size_t(n));
  else return load_xyz(a + 3 * size_t(n));
}
template <int kStride>
DEFORM_INLINE void add(double *f, uint32_t n, v4 a) {
  if constexpr (kStride == 4) {
    store4(f + 4 * size_t(n), load4(f + 4 * size_t(n)) + a);
  } else {
    alignas(32) double t[4];
    store4(t, a);
    for (int k = 0; k < 3; ++k) f[3 * size_t(n) + k] += t[k];
  }
}

template <int kStride>
DEFORM_INLINE void scatter(const Springs &s, const Points &p) {
  for (uint32_t n = 0; n < s.nspring; n += 4) {
    const uint32_t *i = s.i + n, *j = s.j + n;
    const v4 d0 = get<kStride>(p.x, j[0]) - get<kStride>(p.x, i[0]);
    const v4 d1 = get<kStride>(p.x, j[1]) - get<kStride>(p.x, i[1]);
    const v4 d2 = get<kStride>(p.x, j[2]) - get<kStride>(p.x, i[2]);
    const v4 d3 = get<kStride>(p.x, j[3]) - get<kStride>(p.x, i[3]);
    const v4 e0 = get<kStride>(p.v, j[0]) - get<kStride>(p.v, i[0]);
    const v4 e1 = get<kStride>(p.v, j[1]) - get<kStride>(p.v, i[1]);
    const v4 e2 = get<kStride>(p.v, j[2]) - get<kStride>(p.v, i[2]);
    const v4 e3 = get<kStride>(p.v, j[3]) - get<kStride>(p.v, i[3]);
    const v4 scale =
        scale_of(sum_rows(d0 * d0, d1 * d1, d2 * d2, d3 * d3), sum_rows(d0 * e0, d1 * e1, d2 * e2, d3 * e3),
                 load4(s.stiffness + n), load4(s.rest + n), s.damp);
    const v4 f0 = lane<0>(scale) * d0;
    const v4 f1 = lane<1>(scale) * d1;
    const v4 f2 = lane<2>(scale) * d2;
    const v4 f3 = lane<3>(scale) * d3;
    const v4 none = splat(0);
    add<kStride>(p.f, i[0], f0);
    add<kStride>(p.f, j[0], none - f0);
    add<kStride>(p.f, i[1], f1);
    add<kStride>(p.f, j[1], none - f1);
    add<kStride>(p.f, i[2], f2);
    add<kStride>(p.f, j[2], none - f2);
    add<kStride>(p.f, i[3], f3);
    add<kStride>(p.f, j[3], none - f3);
  }
}
static inline void scatter_padded(const Springs &s, const Points &p) { scatter<4>(s, p); }
static inline void scatter_packed(const Springs &s, const Points &p) { scatter<3>(s, p); }

static inline void scatter_split(const Springs &s, const Points &p) {
  const size_t m = s.npoint;
  for (uint32_t n = 0; n < s.nspring; n += 4) {
    const uint32_t *i = s.i + n, *j = s.j + n;
    v4 d[3], e[3];
    for (size_t a = 0; a < 3; ++a) {
      d[a] = gather4(p.x + a * m, j) - gather4(p.x + a * m, i);
      e[a] = gather4(p.v + a * m, j) - gather4(p.v + a * m, i);
    }
    const v4 scale =
        scale_of((d[0] * d[0] + d[1] * d[1]) + d[2] * d[2], (d[0] * e[0] + d[1] * e[1]) + d[2] * e[2],
                 load4(s.stiffness + n), load4(s.rest + n), s.damp);
    for (size_t a = 0; a < 3; ++a) {
      alignas(32) double t[4];
      store4(t, scale * d[a]);
      for (int k = 0; k < 4; ++k) {
        p.f[a * m + i[k]] += t[k];
        p.f[a * m + j[k]] -= t[k];
      }
    }
  }
}

static inline void rows_padded(const Springs &s, const Points &p) {
  for (uint32_t slice = 0; slice < s.nslice; ++slice) {
    const size_t first = 16 * size_t(slice);
    v4 x = load4(p.x + first);
    v4 y = load4(p.x + first + 4);
    v4 z = load4(p.x + first + 8);
    v4 unused = load4(p.x + first + 12);
    transpose(x, y, z, unused);
    v4 vx = load4(p.v + first), vy = load4(p.v + first + 4), vz = load4(p.v + first + 8);
    unused = load4(p.v + first + 12);
    transpose(vx, vy, vz, unused);
    v4 fx = splat(0), fy = splat(0), fz = splat(0);
    for (uint32_t r = s.slice_begin[slice]; r < s.slice_begin[slice + 1]; ++r) {
      const uint32_t *j = s.neighbor + 4 * size_t(r);
      v4 dx = load4(p.x + 4 * size_t(j[0])), dy = load4(p.x + 4 * size_t(j[1]));
      v4 dz = load4(p.x + 4 * size_t(j[2])), dw = load4(p.x + 4 * size_t(j[3]));
      transpose(dx, dy, dz, dw);
      v4 ex = load4(p.v + 4 * size_t(j[0])), ey = load4(p.v + 4 * size_t(j[1]));
      v4 ez = load4(p.v + 4 * size_t(j[2])), ew = load4(p.v + 4 * size_t(j[3]));
      transpose(ex, ey, ez, ew);
      dx = dx - x;
      dy = dy - y;
      dz = dz - z;
      ex = ex - vx;
      ey = ey - vy;
      ez = ez - vz;
      const v4 scale =
          scale_of((dx * dx + dy * dy) + dz * dz, (dx * ex + dy * ey) + dz * ez,
                   load4(s.row_stiffness + 4 * size_t(r)), load4(s.row_rest + 4 * size_t(r)), s.damp);
      fx = fx + scale * dx;
      fy = fy + scale * dy;
      fz = fz + scale * dz;
    }
    v4 fw = splat(0);
    transpose(fx, fy, fz, fw);
    double *f = p.f + first;
    store4(f, load4(f) + fx);
    store4(f + 4, load4(f + 4) + fy);
    store4(f + 8, load4(f + 8) + fz);
    store4(f + 12, load4(f + 12) + fw);
  }
}

static inline void rows_split(const Springs &s, const Points &p) {
  const size_t m = s.npoint;
  for (uint32_t slice = 0; slice < s.nslice; ++slice) {
    const size_t first = 4 * size_t(slice);
    v4 x[3], v[3], f[3];
    for (size_t a = 0; a < 3; ++a) {
      x[a] = load4(p.x + a * m + first);
      v[a] = load4(p.v + a * m + first);
      f[a] = load4(p.f + a * m + first);
    }
    for (uint32_t r = s.slice_begin[slice]; r < s.slice_begin[slice + 1]; ++r) {
      const uint32_t *j = s.neighbor + 4 * size_t(r);
      v4 d[3], e[3];
      for (size_t a = 0; a < 3; ++a) {
        d[a] = gather4(p.x + a * m, j) - x[a];
        e[a] = gather4(p.v + a * m, j) - v[a];
      }
      const v4 scale =
          scale_of((d[0] * d[0] + d[1] * d[1]) + d[2] * d[2], (d[0] * e[0] + d[1] * e[1]) + d[2] * e[2],
                   load4(s.row_stiffness + 4 * size_t(r)), load4(s.row_rest + 4 * size_t(r)), s.damp);
      for (int a = 0; a < 3; ++a) f[a] = f[a] + scale * d[a];
    }
    for (size_t a = 0; a < 3; ++a) store4(p.f + a * m + first, f[a]);
  }
}

constexpr Kernels kKernels = {scatter_padded, scatter_packed, scatter_split, rows_padded, rows_split};

}  // namespace
}  // namespace bound
