// Loops over dense panels of a factor, compiled for several vector widths. Every element sees the same
// operations in the same order at each width.
#pragma once
#include <cstddef>
#include <cstdint>

namespace dfm {

constexpr uint32_t kLanes = 8;        // right-hand sides that are stored beside each other
constexpr uint32_t kTileColumns = 4;  // columns of C that an update takes at a time
constexpr uint32_t kTileRows = 16;    // rows: the most that any width takes at a time

struct DenseKernels {
  const char *name;
  // A panel a[m rows, n columns] of leading dimension lda, lower part: columns become those of L below the
  // unit diagonal, d[n] the pivots. Returns n, or the column whose pivot is not above floor[column].
  uint32_t (*factor)(uint32_t m, uint32_t n, double *a, size_t lda, double *d, const double *floor);
  // For update(): a[m,k] in tiles of rows, a^T times d in tiles of columns.
  void (*pack)(uint32_t m, uint32_t k, const double *a, size_t lda, const double *d, double *pa, double *pb);
  // Columns [begin, end) of C[m, .] -= A D A^T, on and below the diagonal (what is above may change, too);
  // begin is a multiple of kTileColumns.
  void (*update)(uint32_t m, uint32_t begin, uint32_t end, uint32_t k, const double *pa, const double *pb,
                 double *c, size_t ldc);
  // Substitution with the panel of a supernode (supernodes.h) of `width` and `below` points; x: its pivots'
  // rows of kLanes right-hand sides, y: all rows.
  void (*forward)(uint32_t width, uint32_t below, const double *l, const uint32_t *rows, double *x,
                  double *y);
  void (*backward)(uint32_t width, uint32_t below, const double *l, const uint32_t *rows, double *x,
                   const double *y);
  // The same for one right-hand side; scratch holds 3 below doubles.
  void (*forward_one)(uint32_t width, uint32_t below, const double *l, const uint32_t *rows, double *x,
                      double *y, double *scratch);
  void (*backward_one)(uint32_t width, uint32_t below, const double *l, const uint32_t *rows, double *x,
                       const double *y, double *scratch);
  // sum[kLanes, kLanes] += left^T right, both [n, kLanes]; the transposed sum is that of (right, left) to the
  // bit
  void (*gram)(uint32_t n, const double *left, const double *right, double *sum);
  // y[n] += a p, a [n,3] column after column
  void (*add_three)(size_t n, const double *a, const double p[3], double *y);
};

const DenseKernels &dense_kernels_sse2();
const DenseKernels &dense_kernels_avx2();
const DenseKernels &dense_kernels_avx512();

}  // namespace dfm
