// Plain damped-spring kernels to compare the mass-spring plugin with: one flat array of springs, no blocks,
// no ABI, no copies, the same operations, precision and flags. Each stands for a layout of the points and a
// way to sum; the fastest is the practical bound.
#pragma once
#include <stdint.h>

namespace bound {

struct Springs {
  // nspring: rounded up to a multiple of 8 with springs of stiffness zero
  uint32_t npoint, nspring;
  const uint32_t *i, *j;                   // [nspring] ends
  const double *stiffness, *rest;          // [nspring]
  uint32_t nslice, reserved;               // sliced ELLPACK: slices of 4 points, each with `width` neighbors
  const uint32_t *slice_begin;             // [nslice + 1] in rows of 4
  const uint32_t *neighbor;                // [rows, 4]
  const double *row_stiffness, *row_rest;  // [rows, 4]
  double damp;
};
// Points: padded to 4, packed to 3 (with room for one more value at the end), or one array per component (x y
// z at p, p + n, p + 2n).
struct Points {
  const double *x, *v;
  double *f;
};

struct Kernels {
  void (*scatter_padded)(const Springs &s, const Points &p);
  void (*scatter_packed)(const Springs &s, const Points &p);
  void (*scatter_split)(const Springs &s, const Points &p);
  // sliced ELLPACK, both ends computed, nothing scattered
  void (*rows_padded)(const Springs &s, const Points &p);
  void (*rows_split)(const Springs &s, const Points &p);
};
const Kernels *kernels_sse2();
const Kernels *kernels_avx2();
const Kernels *kernels_avx512();

}  // namespace bound
