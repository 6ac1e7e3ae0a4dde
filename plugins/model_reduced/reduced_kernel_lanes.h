// The kernels, compiled once for each instruction set: a V is as many registers as its eight numbers take.
#pragma once
#include "reduced_kernel.h"

namespace reduced {
namespace {

typedef double V __attribute__((vector_size(64), aligned(8), may_alias));

const V &load(const double *p) { return *reinterpret_cast<const V *>(p); }
void store(double *p, const V &v) { *reinterpret_cast<V *>(p) = v; }

void project(const double *w, size_t pieces, size_t nmode, uint32_t n, const double *const *in,
             double *sums) {
  for (size_t p = 0; p < pieces; ++p)
    for (uint32_t v = 0; v < n; ++v) {
      const double *const u = in[v] + p * kPiece;
      const V u0 = load(u), u1 = load(u + kLanes), u2 = load(u + 2 * kLanes), u3 = load(u + 3 * kLanes);
      for (size_t k = 0; k < nmode; ++k) {
        const double *const at = w + (p * nmode + k) * kPiece;
        double *const sum = sums + (v * nmode + k) * kLanes;
        store(sum, load(sum) + ((load(at) * u0 + load(at + kLanes) * u1) +
                                (load(at + 2 * kLanes) * u2 + load(at + 3 * kLanes) * u3)));
      }
    }
}

void expand(const double *w, size_t pieces, size_t nmode, uint32_t n, const double *const *in,
            double *const *out) {
  const double *const second = in[n - 1];
  for (size_t p = 0; p < pieces; ++p)
    for (size_t part = 0; part < kPiece; part += 2 * kLanes) {
      V a0 = {}, a1 = {}, b0 = {}, b1 = {};
      for (size_t k = 0; k < nmode; ++k) {
        const double *const at = w + (p * nmode + k) * kPiece + part;
        const V w0 = load(at), w1 = load(at + kLanes);
        a0 += in[0][k] * w0;
        a1 += in[0][k] * w1;
        if (n == 1) continue;
        b0 += second[k] * w0;
        b1 += second[k] * w1;
      }
      store(out[0] + p * kPiece + part, a0);
      store(out[0] + p * kPiece + part + kLanes, a1);
      if (n == 1) continue;
      store(out[1] + p * kPiece + part, b0);
      store(out[1] + p * kPiece + part + kLanes, b1);
    }
}

// Three rows at a time: those of a surfel.
void rows(const double *rows, size_t nrow, size_t width, const double *y, double *out) {
  for (size_t j = 0; j < nrow; j += 3) {
    const double *const row = rows + width * j;
    V a = {}, b = {}, c = {};
    for (size_t m = 0; m < width; ++m) {
      const V at = load(y + kLanes * m);
      a += row[m] * at;
      b += row[width + m] * at;
      c += row[2 * width + m] * at;
    }
    store(out + kLanes * j, a);
    store(out + kLanes * (j + 1), b);
    store(out + kLanes * (j + 2), c);
  }
}

void solve(const FactorView &f, double *y) {
  constexpr size_t kPoint = 3 * kLanes;
  for (size_t j = 0; j < f.n; ++j) {
    const double *const d = f.block + 9 * size_t(f.begin[j]);
    double *const own = y + kPoint * j;
    const V y0 = load(own) / d[0], y1 = (load(own + kLanes) - d[3] * y0) / d[4],
            y2 = ((load(own + 2 * kLanes) - d[6] * y0) - d[7] * y1) / d[8];
    store(own, y0);
    store(own + kLanes, y1);
    store(own + 2 * kLanes, y2);
    for (uint32_t s = f.begin[j] + 1; s < f.begin[j + 1]; ++s) {
      const double *const l = f.block + 9 * size_t(s);
      double *const to = y + kPoint * f.row[s];
      for (size_t r = 0; r < 3; ++r)
        store(to + r * kLanes,
              load(to + r * kLanes) - ((l[3 * r] * y0 + l[3 * r + 1] * y1) + l[3 * r + 2] * y2));
    }
  }
  for (size_t j = f.n; j-- > 0;) {
    double *const own = y + kPoint * j;
    V y0 = load(own), y1 = load(own + kLanes), y2 = load(own + 2 * kLanes);
    for (uint32_t s = f.begin[j] + 1; s < f.begin[j + 1]; ++s) {
      const double *const l = f.block + 9 * size_t(s);
      const double *const from = y + kPoint * f.row[s];
      const V x0 = load(from), x1 = load(from + kLanes), x2 = load(from + 2 * kLanes);
      y0 -= (l[0] * x0 + l[3] * x1) + l[6] * x2;
      y1 -= (l[1] * x0 + l[4] * x1) + l[7] * x2;
      y2 -= (l[2] * x0 + l[5] * x1) + l[8] * x2;
    }
    const double *const d = f.block + 9 * size_t(f.begin[j]);
    y2 = y2 / d[8];
    y1 = (y1 - d[7] * y2) / d[4];
    store(own, ((y0 - d[3] * y1) - d[6] * y2) / d[0]);
    store(own + kLanes, y1);
    store(own + 2 * kLanes, y2);
  }
}

constexpr Kernels kKernels = {project, expand, rows, solve};

}  // namespace
}  // namespace reduced
