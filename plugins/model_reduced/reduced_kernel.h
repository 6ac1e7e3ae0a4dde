// Loops over many numbers, chosen at run time by instruction set. All of them do the same IEEE operations in
// the same order, kLanes numbers side by side, so that the instruction set never shows in a result. Plain
// data only: kernel files see no STL and nothing with external inline code.
#pragma once
#include <stddef.h>
#include <stdint.h>

namespace reduced {

constexpr size_t kLanes = 8;
constexpr size_t kPiece = 32;  // numbers of a mode side by side in a basis

// c [m,n] += a b, or -= a b; a [m,k] by any strides, b [k,n] and c in rows, n and their lengths multiples of
// kLanes.
struct Product {
  size_t m, n, k;
  const double *a;
  size_t row, column;  // of a, from one to the next
  const double *b;
  size_t b_row;
  double *c;
  size_t c_row;
  bool minus;
};

struct Kernels {
  // sums[v][k][lane] += over the pieces, in[v] of n right-hand sides, n at most 3
  void (*project)(const double *w, size_t pieces, size_t nmode, uint32_t n, const double *const *in,
                  double *sums);
  // out[v] = sum_k W_k in[v][k], n 1 or 2
  void (*expand)(const double *w, size_t pieces, size_t nmode, uint32_t n, const double *const *in,
                 double *const *out);
  // out[row][lane] = sum_m rows[row][m] y[m][lane]
  void (*rows)(const double *rows, size_t nrow, size_t width, const double *y, double *out);
  // out[3,n] = scale r (C f), C [9,n] the blocks of n points, r [9] row-major; n a multiple of kLanes
  void (*turned)(const double *blocks, size_t n, const double *r, const double *f, double scale, double *out);
  // sum[kLanes,kLanes] += left^T right, both [n,kLanes]
  void (*gram)(size_t n, const double *left, const double *right, double *sum);
  // right -= left h, both [n,kLanes], h [kLanes,kLanes]
  void (*take_off)(size_t n, const double *left, const double *h, double *right);
  void (*multiply)(const Product &p);
};

const Kernels *kernels_sse2();
const Kernels *kernels_avx2();
const Kernels *kernels_avx512();

}  // namespace reduced
