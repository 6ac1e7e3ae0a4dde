// The kernels, compiled once for each instruction set; the including file says how many doubles a register
// has (kWidth). No more accumulators are open at a time than registers: what spills costs more than it saves.
#pragma once
#include "reduced_kernel.h"

#define DEFORM_INLINE static inline __attribute__((always_inline))
// Arrays of registers stay in registers only where no loop over them is left.
#if defined(__clang__)
#define DEFORM_UNROLL _Pragma("unroll")
#else
#define DEFORM_UNROLL _Pragma("GCC unroll 16")
#endif

namespace reduced {
namespace {

typedef double V __attribute__((vector_size(8 * kWidth)));
typedef double Anywhere __attribute__((vector_size(8 * kWidth), aligned(8), may_alias));

DEFORM_INLINE V load(const double *p) { return *(const Anywhere *)p; }
DEFORM_INLINE void store(double *p, V v) { *(Anywhere *)p = v; }

constexpr size_t kMaxOpen = 4;  // registers of numbers that one pass over the modes makes
constexpr size_t kOpen = kPiece / kWidth < kMaxOpen ? kPiece / kWidth : kMaxOpen;
// Registers of lanes that one pass over a row makes, for kRowsAtOnce rows.
constexpr size_t kSide = kLanes / kWidth < 2 ? kLanes / kWidth : 2;
constexpr size_t kRowsAtOnce = 6;

void project(const double *w, size_t pieces, size_t nmode, uint32_t n, const double *const *in,
             double *sums) {
  for (size_t p = 0; p < pieces; ++p)
    for (uint32_t v = 0; v < n; ++v)
      for (size_t part = 0; part < kLanes; part += kWidth) {
        const double *const u = in[v] + p * kPiece + part;
        const V u0 = load(u), u1 = load(u + kLanes), u2 = load(u + 2 * kLanes), u3 = load(u + 3 * kLanes);
        for (size_t k = 0; k < nmode; ++k) {
          const double *const at = w + (p * nmode + k) * kPiece + part;
          double *const sum = sums + (v * nmode + k) * kLanes + part;
          store(sum, load(sum) + ((load(at) * u0 + load(at + kLanes) * u1) +
                                  (load(at + 2 * kLanes) * u2 + load(at + 3 * kLanes) * u3)));
        }
      }
}

// kOpen registers of each of N right-hand sides.
template <uint32_t N>
DEFORM_INLINE void expand_part(const double *w, size_t nmode, const double *const *in, double *const *out) {
  V sum[N][kOpen] = {};
  for (size_t k = 0; k < nmode; ++k) {
    const double *const at = w + k * kPiece;
    DEFORM_UNROLL for (size_t r = 0; r < kOpen; ++r) {
      const V own = load(at + r * kWidth);
      DEFORM_UNROLL for (uint32_t v = 0; v < N; ++v) sum[v][r] += in[v][k] * own;
    }
  }
  DEFORM_UNROLL for (uint32_t v = 0; v < N; ++v) DEFORM_UNROLL for (size_t r = 0; r < kOpen; ++r)
      store(out[v] + r * kWidth, sum[v][r]);
}

template <uint32_t N>
DEFORM_INLINE void expand_all(const double *w, size_t pieces, size_t nmode, const double *const *in,
                              double *const *out) {
  for (size_t p = 0; p < pieces; ++p)
    for (size_t part = 0; part < kPiece; part += kOpen * kWidth) {
      double *to[N];
      for (uint32_t v = 0; v < N; ++v) to[v] = out[v] + p * kPiece + part;
      expand_part<N>(w + p * nmode * kPiece + part, nmode, in, to);
    }
}

void expand(const double *w, size_t pieces, size_t nmode, uint32_t n, const double *const *in,
            double *const *out) {
  if (n == 1) expand_all<1>(w, pieces, nmode, in, out);
  else expand_all<2>(w, pieces, nmode, in, out);
}

template <size_t R>
DEFORM_INLINE void some_rows(const double *row, size_t width, const double *y, double *out) {
  for (size_t part = 0; part < kLanes; part += kSide * kWidth) {
    V sum[R][kSide] = {};
    for (size_t m = 0; m < width; ++m) {
      V at[kSide];
      DEFORM_UNROLL for (size_t s = 0; s < kSide; ++s) at[s] = load(y + kLanes * m + part + s * kWidth);
      DEFORM_UNROLL for (size_t r = 0; r < R; ++r) DEFORM_UNROLL for (size_t s = 0; s < kSide; ++s)
          sum[r][s] += row[width * r + m] * at[s];
    }
    DEFORM_UNROLL for (size_t r = 0; r < R; ++r) DEFORM_UNROLL for (size_t s = 0; s < kSide; ++s)
        store(out + kLanes * r + part + s * kWidth, sum[r][s]);
  }
}

// nrow is a multiple of three: a surfel or a point has as many.
void rows(const double *rows, size_t nrow, size_t width, const double *y, double *out) {
  size_t j = 0;
  for (; j + kRowsAtOnce <= nrow; j += kRowsAtOnce)
    some_rows<kRowsAtOnce>(rows + width * j, width, y, out + kLanes * j);
  for (; j < nrow; j += 3) some_rows<3>(rows + width * j, width, y, out + kLanes * j);
}

void turned(const double *blocks, size_t n, const double *r, const double *f, double scale, double *out) {
  for (size_t i = 0; i < n; i += kWidth) {
    V u[3];
    DEFORM_UNROLL for (size_t a = 0; a < 3; ++a) {
      const double *const c = blocks + 3 * a * n + i;
      u[a] = (load(c) * f[0] + load(c + n) * f[1]) + load(c + 2 * n) * f[2];
    }
    DEFORM_UNROLL for (size_t a = 0; a < 3; ++a)
        store(out + a * n + i, scale * ((r[3 * a] * u[0] + r[3 * a + 1] * u[1]) + r[3 * a + 2] * u[2]));
  }
}

void gram(size_t n, const double *left, const double *right, double *sum) {
  for (size_t part = 0; part < kLanes; part += kWidth) {
    V s[kLanes];
    DEFORM_UNROLL for (size_t a = 0; a < kLanes; ++a) s[a] = load(sum + a * kLanes + part);
    for (size_t i = 0; i < n; ++i) {
      const V own = load(right + i * kLanes + part);
      DEFORM_UNROLL for (size_t a = 0; a < kLanes; ++a) s[a] += left[i * kLanes + a] * own;
    }
    DEFORM_UNROLL for (size_t a = 0; a < kLanes; ++a) store(sum + a * kLanes + part, s[a]);
  }
}

void take_off(size_t n, const double *left, const double *h, double *right) {
  for (size_t part = 0; part < kLanes; part += kWidth) {
    V s[kLanes];
    DEFORM_UNROLL for (size_t a = 0; a < kLanes; ++a) s[a] = load(h + a * kLanes + part);
    for (size_t i = 0; i < n; ++i) {
      V sum = left[i * kLanes] * s[0];
      DEFORM_UNROLL for (size_t a = 1; a < kLanes; ++a) sum += left[i * kLanes + a] * s[a];
      store(right + i * kLanes + part, load(right + i * kLanes + part) - sum);
    }
  }
}

template <bool Minus, size_t R, size_t S>
DEFORM_INLINE void multiply_part(const Product &p, size_t i, size_t j, size_t from, size_t until) {
  V sum[R][S];
  DEFORM_UNROLL for (size_t r = 0; r < R; ++r) DEFORM_UNROLL for (size_t s = 0; s < S; ++s) sum[r][s] =
      load(p.c + (i + r) * p.c_row + j + s * kWidth);
  for (size_t k = from; k < until; ++k) {
    const double *const a = p.a + i * p.row + k * p.column, *const b = p.b + k * p.b_row + j;
    V at[S];
    DEFORM_UNROLL for (size_t s = 0; s < S; ++s) at[s] = load(b + s * kWidth);
    DEFORM_UNROLL for (size_t r = 0; r < R; ++r) DEFORM_UNROLL for (size_t s = 0; s < S; ++s) sum[r][s] =
        Minus ? sum[r][s] - a[r * p.row] * at[s] : sum[r][s] + a[r * p.row] * at[s];
  }
  DEFORM_UNROLL for (size_t r = 0; r < R; ++r) DEFORM_UNROLL for (size_t s = 0; s < S; ++s)
      store(p.c + (i + r) * p.c_row + j + s * kWidth, sum[r][s]);
}

template <bool Minus, size_t S>
DEFORM_INLINE void multiply_columns(const Product &p, size_t j, size_t from, size_t until) {
  size_t i = 0;
  for (; i + 4 <= p.m; i += 4) multiply_part<Minus, 4, S>(p, i, j, from, until);
  for (; i < p.m; ++i) multiply_part<Minus, 1, S>(p, i, j, from, until);
}

// Rows of b in parts that stay in the first cache.
template <bool Minus>
DEFORM_INLINE void multiply_all(const Product &p) {
  constexpr size_t kPart = 128, kColumns = 3;
  for (size_t from = 0; from < p.k; from += kPart) {
    const size_t until = from + kPart < p.k ? from + kPart : p.k;
    size_t j = 0;
    for (; j + kColumns * kWidth <= p.n; j += kColumns * kWidth)
      multiply_columns<Minus, kColumns>(p, j, from, until);
    for (; j < p.n; j += kWidth) multiply_columns<Minus, 1>(p, j, from, until);
  }
}

void multiply(const Product &p) {
  if (p.minus) multiply_all<true>(p);
  else multiply_all<false>(p);
}

constexpr Kernels kKernels = {project, expand, rows, turned, gram, take_off, multiply};

}  // namespace
}  // namespace reduced
