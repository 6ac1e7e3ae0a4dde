// Vectors of three and matrices of nine numbers, row-major, beyond those of all models.
#pragma once
#include <deform/elementary.h>

#include <cmath>
#include <cstddef>

#include "../model_common/small.h"

namespace reduced {

using model::dot;
using model::invert;
using model::matrix_product;
using model::product;

inline void cross_add(const double *a, const double *b, double scale, double *out) {
  out[0] += scale * (a[1] * b[2] - a[2] * b[1]);
  out[1] += scale * (a[2] * b[0] - a[0] * b[2]);
  out[2] += scale * (a[0] * b[1] - a[1] * b[0]);
}
inline void transposed_product(const double *m, const double *x, double *out) {
  for (int i = 0; i < 3; ++i) out[i] = (m[i] * x[0] + m[3 + i] * x[1]) + m[6 + i] * x[2];
}

// The upper triangle of the moment of inertia of a mass m at r is added to out.
inline void inertia_add(const double *r, double m, double *out) {
  const double square = (r[0] * r[0] + r[1] * r[1]) + r[2] * r[2];
  out[0] += m * (square - r[0] * r[0]);
  out[1] += m * (0 - r[0] * r[1]);
  out[2] += m * (0 - r[0] * r[2]);
  out[4] += m * (square - r[1] * r[1]);
  out[5] += m * (0 - r[1] * r[2]);
  out[8] += m * (square - r[2] * r[2]);
}
inline void mirror_upper(double *a) {
  a[3] = a[1];
  a[6] = a[2];
  a[7] = a[5];
}

// Gram and Schmidt's method, twice, on the rows[n,size].
template <size_t kN, class Product>
inline void orthonormalize(double *const (&row)[kN], size_t size, const Product &product_of) {
  for (size_t k = 0; k < kN; ++k) {
    for (int twice = 0; twice < 2; ++twice)
      for (size_t l = 0; l < k; ++l) {
        const double along = product_of(row[k], row[l]);
        for (size_t j = 0; j < size; ++j) row[k][j] -= along * row[l][j];
      }
    const double scale = 1 / std::sqrt(product_of(row[k], row[k]));
    for (size_t j = 0; j < size; ++j) row[k][j] *= scale;
  }
}

// out = exp([w]) r, Rodrigues' formula; w is the rotation's axis times its angle.
inline void turned(const double *w, const double *r, double *out) {
  const double square = (w[0] * w[0] + w[1] * w[1]) + w[2] * w[2], angle = std::sqrt(square);
  constexpr double kPi = 0x1.921fb54442d18p+1;
  double s = 1 - square / 6, c = 0.5 - square / 24;  // sin a / a, (1 - cos a) / a^2
  if (angle > 1e-3) {
    const double half = dfm_sinpi(0.5 * angle / kPi);
    s = dfm_sinpi(angle / kPi) / angle;
    c = 2 * half * half / square;
  }
  double e[9];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) e[3 * i + j] = c * w[i] * w[j] + (i == j ? 1 - c * square : 0);
  e[1] -= s * w[2];
  e[2] += s * w[1];
  e[3] += s * w[2];
  e[5] -= s * w[0];
  e[6] -= s * w[1];
  e[7] += s * w[0];
  matrix_product(e, r, out);
}

}  // namespace reduced
