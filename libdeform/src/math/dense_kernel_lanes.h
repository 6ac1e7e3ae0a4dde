// The loops of dense_kernel.h for vectors of kWidth doubles.
#pragma once
#include "dense_kernel.h"
#include "kernel_vector.h"

namespace dfm {
namespace {

constexpr uint32_t kParts = kLanes / kWidth;  // vectors that hold one row of right-hand sides
constexpr uint32_t kRows = 2 * kWidth;        // rows of an update's tile

// Rows [begin, m) of a column less s times another.
DEFORM_INLINE void subtract_scaled(uint32_t begin, uint32_t m, double s, const double *from, double *to) {
  uint32_t i = begin;
  const Vector v = splat(s);
  for (; i + kWidth <= m; i += kWidth) store(to + i, load(to + i) - load(from + i) * v);
  for (; i < m; ++i) to[i] -= from[i] * s;
}

uint32_t factor(uint32_t m, uint32_t n, double *a, size_t lda, double *d, const double *floor) {
  for (uint32_t j = 0; j < n; ++j) {
    double *const column = a + j * lda;
    const double pivot = column[j];
    if (!(pivot > floor[j]) || !(pivot <= __DBL_MAX__)) return j;
    d[j] = pivot;
    const double inverse = 1 / pivot;
    uint32_t i = j + 1;
    const Vector v = splat(inverse);
    for (; i + kWidth <= m; i += kWidth) store(column + i, load(column + i) * v);
    for (; i < m; ++i) column[i] *= inverse;
    for (uint32_t k = j + 1; k < n; ++k) subtract_scaled(k, m, column[k] * pivot, column, a + k * lda);
  }
  return n;
}

void pack(uint32_t m, uint32_t k, const double *a, size_t lda, const double *d, double *pa, double *pb) {
  for (uint32_t i = 0; i < m; i += kRows)
    for (uint32_t c = 0; c < k; ++c, pa += kRows) DEFORM_UNROLL
  for (uint32_t r = 0; r < kRows; ++r) pa[r] = i + r < m ? a[i + r + c * lda] : 0.0;
  for (uint32_t i = 0; i < m; i += kTileColumns)
    for (uint32_t c = 0; c < k; ++c, pb += kTileColumns) DEFORM_UNROLL
  for (uint32_t r = 0; r < kTileColumns; ++r) pb[r] = i + r < m ? a[i + r + c * lda] * d[c] : 0.0;
}

void update(uint32_t m, uint32_t begin, uint32_t end, uint32_t k, const double *pa, const double *pb,
            double *c, size_t ldc) {
  for (uint32_t j = begin; j < end; j += kTileColumns)
    for (uint32_t i = j / kRows * kRows; i < m; i += kRows) {
      const double *left = pa + size_t(i) * k, *right = pb + size_t(j) * k;
      Vector sum[kTileColumns][2] = {};
      for (uint32_t e = 0; e < k; ++e, left += kRows, right += kTileColumns) {
        const Vector low = load(left), high = load(left + kWidth);
        DEFORM_UNROLL
        for (uint32_t q = 0; q < kTileColumns; ++q) {
          const Vector s = splat(right[q]);
          sum[q][0] += low * s;
          sum[q][1] += high * s;
        }
      }
      DEFORM_UNROLL
      for (uint32_t q = 0; q < kTileColumns; ++q) {
        if (j + q >= end) break;
        double *const to = c + i + (j + q) * ldc;
        if (i + kRows <= m) {
          store(to, load(to) - sum[q][0]);
          store(to + kWidth, load(to + kWidth) - sum[q][1]);
          continue;
        }
        double rest[kRows];
        store(rest, sum[q][0]);
        store(rest + kWidth, sum[q][1]);
        for (uint32_t r = 0; i + r < m; ++r) to[r] -= rest[r];
      }
    }
}

// sum[3 points] = rows `first` ... of the panel times the columns [0, n) of right-hand sides
template <uint32_t kPoints>
DEFORM_INLINE void times_columns(uint32_t n, const double *l, size_t ld, const double *x,
                                 Vector (&sum)[3 * kPoints][kParts]) {
  for (uint32_t k = 0; k < n; ++k, l += ld, x += kLanes) {
    Vector v[kParts];
    DEFORM_UNROLL
    for (uint32_t p = 0; p < kParts; ++p) v[p] = load(x + p * kWidth);
    DEFORM_UNROLL
    for (uint32_t r = 0; r < 3 * kPoints; ++r) {
      const Vector s = splat(l[r]);
      DEFORM_UNROLL
      for (uint32_t p = 0; p < kParts; ++p) sum[r][p] += s * v[p];
    }
  }
}

DEFORM_INLINE void subtract(double *to, const Vector (&sum)[kParts]) {
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) store(to + p * kWidth, load(to + p * kWidth) - sum[p]);
}

// row r of a point less l times row c
DEFORM_INLINE void eliminate(double *to, double l, const double *from) {
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p)
    store(to + p * kWidth, load(to + p * kWidth) - splat(l) * load(from + p * kWidth));
}

// Points [begin, end) less these rows of the panel times its n columns; to(point): their right-hand sides.
template <uint32_t kPoints, class To>
DEFORM_INLINE void forward_rows(uint32_t begin, uint32_t end, uint32_t n, const double *l, size_t ld,
                                const double *x, const To &to) {
  for (; begin + kPoints <= end; begin += kPoints) {
    Vector sum[3 * kPoints][kParts] = {};
    times_columns<kPoints>(n, l + 3 * size_t(begin), ld, x, sum);
    DEFORM_UNROLL
    for (uint32_t q = 0; q < kPoints; ++q) DEFORM_UNROLL
    for (uint32_t r = 0; r < 3; ++r) subtract(to(begin + q) + r * kLanes, sum[3 * q + r]);
  }
  if constexpr (kPoints > 1) forward_rows<1>(begin, end, n, l, ld, x, to);
}

constexpr uint32_t kPoints = kWidth == 2 ? 1 : kWidth == 4 ? 2 : 3;  // as many sums as there are registers
// Columns of so many points are used up before the next ones: the rows that one pass touches then lie in as
// many pages as have a place in the first translation buffer.
constexpr uint32_t kColumnPoints = 8;

void forward(uint32_t width, uint32_t below, const double *l, const uint32_t *rows, double *x, double *y) {
  const size_t ld = 3 * size_t(width + below);
  for (uint32_t first = 0; first < width; first += kColumnPoints) {
    const uint32_t last = width - first > kColumnPoints ? first + kColumnPoints : width,
                   n = 3 * (last - first);
    const double *const columns = l + 3 * size_t(first) * ld;
    double *const solved = x + 3 * size_t(first) * kLanes;
    for (uint32_t w = first; w < last; ++w) {
      double *const own = x + 3 * size_t(w) * kLanes;
      forward_rows<1>(w, w + 1, 3 * (w - first), columns, ld, solved, [&](uint32_t) { return own; });
      const double *const diagonal = l + 3 * size_t(w) * (ld + 1);
      eliminate(own + kLanes, diagonal[1], own);
      eliminate(own + 2 * kLanes, diagonal[2], own);
      eliminate(own + 2 * kLanes, diagonal[2 + ld], own + kLanes);
    }
    forward_rows<kPoints>(last, width, n, columns, ld, solved,
                          [&](uint32_t point) { return x + 3 * size_t(point) * kLanes; });
    forward_rows<kPoints>(width, width + below, n, columns, ld, solved,
                          [&](uint32_t point) { return y + 3 * size_t(rows[point - width]) * kLanes; });
  }
}

// sum[3] += columns of a point of the panel times three rows of right-hand sides
DEFORM_INLINE void times_rows(const double *l, size_t ld, const double *y, Vector (&sum)[3][kParts]) {
  for (uint32_t r = 0; r < 3; ++r, y += kLanes) {
    Vector v[kParts];
    DEFORM_UNROLL
    for (uint32_t p = 0; p < kParts; ++p) v[p] = load(y + p * kWidth);
    DEFORM_UNROLL
    for (uint32_t c = 0; c < 3; ++c) {
      const Vector s = splat(l[r + c * ld]);
      DEFORM_UNROLL
      for (uint32_t p = 0; p < kParts; ++p) sum[c][p] += s * v[p];
    }
  }
}

void backward(uint32_t width, uint32_t below, const double *l, const uint32_t *rows, double *x,
              const double *y) {
  const size_t ld = 3 * size_t(width + below);
  for (uint32_t w = width; w-- > 0;) {
    double *const own = x + 3 * size_t(w) * kLanes;
    const double *const columns = l + 3 * size_t(w) * ld;
    Vector sum[3][kParts] = {};
    for (uint32_t b = 0; b < below; ++b)
      times_rows(columns + 3 * size_t(width + b), ld, y + 3 * size_t(rows[b]) * kLanes, sum);
    for (uint32_t k = w + 1; k < width; ++k)
      times_rows(columns + 3 * size_t(k), ld, x + 3 * size_t(k) * kLanes, sum);
    DEFORM_UNROLL
    for (uint32_t r = 0; r < 3; ++r) subtract(own + r * kLanes, sum[r]);
    const double *const diagonal = columns + 3 * size_t(w);
    eliminate(own + kLanes, diagonal[2 + ld], own + 2 * kLanes);
    eliminate(own, diagonal[2], own + 2 * kLanes);
    eliminate(own, diagonal[1], own + kLanes);
  }
}

void forward_one(uint32_t width, uint32_t below, const double *l, const uint32_t *rows, double *x, double *y,
                 double *scratch) {
  const uint32_t n = 3 * width, m = 3 * below;
  const size_t ld = size_t(n) + m;
  for (uint32_t k = 0; k < n; ++k) subtract_scaled(k + 1, n, x[k], l + k * ld, x);
  const double *const under = l + n;
  uint32_t i = 0;
  for (; i + 4 * kWidth <= m; i += 4 * kWidth) {
    Vector sum[4] = {};
    for (uint32_t k = 0; k < n; ++k) {
      const Vector s = splat(x[k]);
      DEFORM_UNROLL
      for (uint32_t q = 0; q < 4; ++q) sum[q] += load(under + k * ld + i + q * kWidth) * s;
    }
    DEFORM_UNROLL
    for (uint32_t q = 0; q < 4; ++q) store(scratch + i + q * kWidth, sum[q]);
  }
  for (; i < m; ++i) {
    double sum = 0;
    for (uint32_t k = 0; k < n; ++k) sum += under[k * ld + i] * x[k];
    scratch[i] = sum;
  }
  for (uint32_t b = 0; b < below; ++b) DEFORM_UNROLL
  for (uint32_t r = 0; r < 3; ++r) y[3 * size_t(rows[b]) + r] -= scratch[3 * b + r];
}

// Eight sums per column, whatever the width, added in pairs.
DEFORM_INLINE double add_lanes(const double *s) {
  return ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7]));
}

template <uint32_t kColumns>
DEFORM_INLINE void dots(uint32_t n, const double *l, size_t ld, const double *y, double *out) {
  Vector sum[kColumns][kParts] = {};
  uint32_t i = 0;
  for (; i + kLanes <= n; i += kLanes) DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) {
    const Vector v = load(y + i + p * kWidth);
    DEFORM_UNROLL
    for (uint32_t c = 0; c < kColumns; ++c) sum[c][p] += load(l + c * ld + i + p * kWidth) * v;
  }
  DEFORM_UNROLL
  for (uint32_t c = 0; c < kColumns; ++c) {
    double lanes[kLanes];
    DEFORM_UNROLL
    for (uint32_t p = 0; p < kParts; ++p) store(lanes + p * kWidth, sum[c][p]);
    for (uint32_t k = i; k < n; ++k) lanes[k - i] += l[c * ld + k] * y[k];
    out[c] = add_lanes(lanes);
  }
}

void backward_one(uint32_t width, uint32_t below, const double *l, const uint32_t *rows, double *x,
                  const double *y, double *scratch) {
  const uint32_t n = 3 * width, m = 3 * below;
  const size_t ld = size_t(n) + m;
  for (uint32_t b = 0; b < below; ++b) DEFORM_UNROLL
  for (uint32_t r = 0; r < 3; ++r) scratch[3 * b + r] = y[3 * size_t(rows[b]) + r];
  for (uint32_t w = width; w-- > 0;) {
    double *const own = x + 3 * size_t(w);
    const double *const columns = l + 3 * size_t(w) * ld;
    double sum[3], part[3];
    dots<3>(m, columns + n, ld, scratch, sum);
    dots<3>(n - 3 * (w + 1), columns + 3 * size_t(w + 1), ld, own + 3, part);
    DEFORM_UNROLL
    for (uint32_t c = 0; c < 3; ++c) own[c] -= sum[c] + part[c];
    const double *const diagonal = columns + 3 * size_t(w);
    own[1] -= diagonal[2 + ld] * own[2];
    own[0] -= diagonal[2] * own[2];
    own[0] -= diagonal[1] * own[1];
  }
}

void gram(uint32_t n, const double *left, const double *right, double *sum) {
  DEFORM_UNROLL
  for (uint32_t p = 0; p < kParts; ++p) {
    Vector s[kLanes];
    DEFORM_UNROLL
    for (uint32_t a = 0; a < kLanes; ++a) s[a] = load(sum + a * kLanes + p * kWidth);
    for (uint32_t k = 0; k < n; ++k) {
      const Vector v = load(right + size_t(k) * kLanes + p * kWidth);
      DEFORM_UNROLL
      for (uint32_t a = 0; a < kLanes; ++a) s[a] += splat(left[size_t(k) * kLanes + a]) * v;
    }
    DEFORM_UNROLL
    for (uint32_t a = 0; a < kLanes; ++a) store(sum + a * kLanes + p * kWidth, s[a]);
  }
}

void add_three(size_t n, const double *a, const double p[3], double *y) {
  const double *const b = a + n, *const c = b + n;
  const Vector px = splat(p[0]), py = splat(p[1]), pz = splat(p[2]);
  size_t i = 0;
  for (; i + kWidth <= n; i += kWidth)
    store(y + i, load(y + i) + ((load(a + i) * px + load(b + i) * py) + load(c + i) * pz));
  for (; i < n; ++i) y[i] += (a[i] * p[0] + b[i] * p[1]) + c[i] * p[2];
}

constexpr DenseKernels kKernels = {kWidth == 2   ? "sse2"
                                   : kWidth == 4 ? "avx2"
                                                 : "avx512",
                                   factor,
                                   pack,
                                   update,
                                   forward,
                                   backward,
                                   forward_one,
                                   backward_one,
                                   gram,
                                   add_three};

}  // namespace
}  // namespace dfm
