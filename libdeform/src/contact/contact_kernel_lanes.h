// The loops of contact_kernel.h for vectors of kWidth (2 or 4) doubles, which the including file defines.
#pragma once
#include "math/kernel_vector.h"
#include "contact_kernel.h"
#include "friction_kernel.h"

namespace dfm {
namespace {

constexpr uint32_t kParts = 4 / kWidth;  // vectors that hold four doubles

// Components of a point, the last of which is ignored; or four partial sums.
struct Four { Vector part[kParts]; };

DEFORM_INLINE double get(const Four &a, uint32_t k) { return a.part[k / kWidth][k % kWidth]; }
DEFORM_INLINE Four load_four(const double *a) {
  Four out;
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) out.part[p] = load(a + p * kWidth);
  return out;
}
DEFORM_INLINE void store_four(double *to, const Four &a) {
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) store(to + p * kWidth, a.part[p]);
}
DEFORM_INLINE Four operator+(Four a, const Four &b) {
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) a.part[p] += b.part[p];
  return a;
}
DEFORM_INLINE Four operator-(Four a, const Four &b) {
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) a.part[p] -= b.part[p];
  return a;
}
DEFORM_INLINE Four operator*(Four a, const Four &b) {
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) a.part[p] *= b.part[p];
  return a;
}
DEFORM_INLINE Four operator*(double s, Four a) {
  const Vector all = splat(s);
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) a.part[p] *= all;
  return a;
}
DEFORM_INLINE double total(const Four &a) { return (get(a, 0) + get(a, 1)) + (get(a, 2) + get(a, 3)); }

// Of contact i in its frame, relative.
DEFORM_INLINE Four velocity(const RowsView &rows, const double *y, uint32_t i) {
  Four u = {};
  for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j)
    u = u + rows.weight[j] * load_four(y + 4 * size_t(rows.dof[j]));
  const double *const f = rows.across + 9 * size_t(i);
  const Four in_frame =
      (get(u, 0) * load_four(f) + get(u, 1) * load_four(f + 3)) + get(u, 2) * load_four(f + 6);
  return in_frame - load_four(rows.drive + 3 * size_t(i));
}

DEFORM_INLINE void apply(const RowsView &rows, double *y, uint32_t i, double a, double b, double c) {
  const double *const f = rows.frame + 9 * size_t(i);
  const Four p = (a * load_four(f) + b * load_four(f + 3)) + c * load_four(f + 6);
  for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j) {
    const size_t at = 4 * size_t(rows.dof[j]);
    store_four(y + at, load_four(y + at) + rows.weight[j] * (load_four(rows.alone + at) * p));
  }
}

void sweep(const RowsView &rows, const LawView &law, double h, double *y, double *impulse) {
  for (uint32_t i = 0; i < rows.n; ++i) {
    if (!(rows.wn[i] > 0)) continue;  // both sides are held: impulses have no effect
    const Four v = velocity(rows, y, i);
    double by[3];
    if (solve_row(rows, law, i, h, {get(v, 0), get(v, 1), get(v, 2)}, impulse + 3 * size_t(i), by))
      apply(rows, y, i, by[0], by[1], by[2]);
  }
}

Residual residual(const RowsView &rows, const LawView &law, const ToleranceView &tolerance, double h,
                  const double *y, const double *impulse) {
  Residual r;
  double nan_flag = 0;
  for (uint32_t i = 0; i < rows.n; ++i) {
    if (!(rows.wn[i] > 0)) continue;
    const Four v = velocity(rows, y, i);
    add_residual(rows, law, tolerance, i, h, {get(v, 0), get(v, 1), get(v, 2)}, impulse + 3 * size_t(i), r,
                 nan_flag);
  }
  if (nan_flag != 0) r.relative = r.required = __builtin_inf();
  return r;
}

void leap(const RowsView &rows, const double *jump, double *y, double *impulse) {
  for (uint32_t i = 0; i < rows.n; ++i) {
    const double *const by = jump + 3 * size_t(i);
    double *const l = impulse + 3 * size_t(i);
    const double normal = larger(by[0], -l[0]);
    if (normal == 0 && by[1] == 0 && by[2] == 0) continue;
    apply(rows, y, i, normal, by[1], by[2]);
    l[0] += normal;
    l[1] += by[1];
    l[2] += by[2];
  }
}

void differences(size_t n, const double *metric, const double *now, const double *from, double *f, double *g,
                 double *df, double *dg) {
  for (size_t k = 0; k < n; k += 4) {
    const Four there = load_four(now + k), step = load_four(metric + k) * (there - load_four(from + k));
    if (df) {
      store_four(df + k, step - load_four(f + k));
      store_four(dg + k, there - load_four(g + k));
    }
    store_four(f + k, step);
    store_four(g + k, there);
  }
}

// One sum would wait for each addition; four sums run in parallel.
void dots(size_t n, const double *a, const double *b, const double *y, const double *z, double out[4]) {
  Four ay = {}, az = {}, by = {}, bz = {};
  for (size_t k = 0; k < n; k += 4) {
    const Four p = load_four(a + k), q = load_four(b + k), u = load_four(y + k), v = load_four(z + k);
    ay = ay + p * u;
    az = az + p * v;
    by = by + q * u;
    bz = bz + q * v;
  }
  out[0] = total(ay);
  out[1] = total(az);
  out[2] = total(by);
  out[3] = total(bz);
}

void combine(size_t n, uint32_t count, const double *gamma, const double *dg, double *out) {
  for (size_t k = 0; k < n; k += 4) {
    Four sum = {};
    for (uint32_t j = 0; j < count; ++j) sum = sum - gamma[j] * load_four(dg + j * n + k);
    store_four(out + k, sum);
  }
}

constexpr ContactKernels kKernels = {sweep, residual, leap, differences, dots, combine};

}  // namespace
}  // namespace dfm
