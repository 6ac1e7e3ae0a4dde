// The loops of block_kernel.h for vectors of kWidth (2 or 4) doubles.
#pragma once
#include "block_kernel.h"
#include "kernel_vector.h"

namespace dfm {
namespace {

constexpr uint32_t kParts = 4 / kWidth;  // vectors that hold a column and a lane more

// sum[c] += column c of the block times x[c]
DEFORM_INLINE void add_block(const double *a, const double *x, Vector (&sum)[3][kParts]) {
  DEFORM_UNROLL
  for (uint32_t c = 0; c < 3; ++c) {
    const Vector s = splat(x[c]);
    DEFORM_UNROLL
    for (uint32_t p = 0; p < kParts; ++p) sum[c][p] += load(a + 3 * c + p * kWidth) * s;
  }
}

DEFORM_INLINE void total(const Vector (&sum)[3][kParts], double *out) {
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) store(out + p * kWidth, (sum[0][p] + sum[1][p]) + sum[2][p]);
}

DEFORM_INLINE double keep(const double *y, const double *x, double *to) {
  DEFORM_UNROLL
  for (uint32_t r = 0; r < 3; ++r) to[r] = y[r];
  return (x[0] * y[0] + x[1] * y[1]) + x[2] * y[2];
}

double multiply(const BlockRows &a, uint32_t begin, uint32_t end, const double *x, double *y) {
  double dot = 0;
  for (uint32_t i = begin; i < end; ++i) {
    // Every second block has its own sums: none waits for another.
    Vector even[3][kParts] = {}, odd[3][kParts] = {};
    uint32_t k = a.row[i];
    const uint32_t last = a.row[i + 1];
    for (; k < last; k += 2) {
      add_block(a.value + 9 * size_t(k), x + 3 * size_t(a.column[k]), even);
      add_block(a.value + 9 * size_t(k) + 9, x + 3 * size_t(a.column[k + 1]), odd);
    }
    DEFORM_UNROLL
    for (uint32_t c = 0; c < 3; ++c) DEFORM_UNROLL
    for (uint32_t p = 0; p < kParts; ++p) even[c][p] += odd[c][p];
    double out[4];
    total(even, out);
    dot += keep(out, x + 3 * size_t(i), y + 3 * size_t(i));
  }
  return dot;
}

double diagonal(const double *m, uint32_t begin, uint32_t end, const double *r, double *z) {
  double dot = 0;
  for (uint32_t i = begin; i < end; ++i) {
    Vector sum[3][kParts] = {};
    add_block(m + 9 * size_t(i), r + 3 * size_t(i), sum);
    double out[4];
    total(sum, out);
    dot += keep(out, r + 3 * size_t(i), z + 3 * size_t(i));
  }
  return dot;
}

void advance(uint32_t begin, uint32_t end, double alpha, const double *p, const double *q, double *x,
             double *r) {
  const Vector a = splat(alpha);
  size_t e = 3 * size_t(begin);
  for (; e + kWidth <= 3 * size_t(end); e += kWidth) {
    store(x + e, load(x + e) + a * load(p + e));
    store(r + e, load(r + e) - a * load(q + e));
  }
  for (; e < 3 * size_t(end); ++e) {
    x[e] += alpha * p[e];
    r[e] -= alpha * q[e];
  }
}

void turn(uint32_t begin, uint32_t end, double beta, const double *z, double *p) {
  const Vector b = splat(beta);
  size_t e = 3 * size_t(begin);
  for (; e + kWidth <= 3 * size_t(end); e += kWidth) store(p + e, load(z + e) + b * load(p + e));
  for (; e < 3 * size_t(end); ++e) p[e] = z[e] + beta * p[e];
}

constexpr BlockKernels kKernels = {multiply, diagonal, advance, turn};

}  // namespace
}  // namespace dfm
