// The functions that goals are made of, and their moments over a cluster's points.
#pragma once
#include <cmath>

#include "../model_common/rotation.h"
#include "../model_common/small.h"
#include "shape_body.h"

namespace shape {

// out = the inverse of a symmetric matrix on the directions whose eigenvalue is above `least` of the
// largest, zero on the others: what a flat cluster, a line or a point has no extent along. The largest
// counts as `most` at least.
template <int kN>
inline void inverse_of(const double *matrix, double least, double *out, double most = 0) {
  double a[kN][kN];
  for (int e = 0; e < kN * kN; ++e) a[e / kN][e % kN] = matrix[e];
  model::spectral_inverse(a, out, [&](double x, double largest) {
    return x > least * (largest > most ? largest : most) ? x : 0;
  });
}
constexpr double kFlat = 1e-10;  // of moments, least

// The root of the inverse, and that of the determinant; what is flat has neither.
inline void roots_of(const double *matrix, double *out, double *content) {
  double a[3][3];
  for (int e = 0; e < 9; ++e) a[e / 3][e % 3] = matrix[e];
  *content = 1;
  model::spectral_inverse(a, out, [&](double x, double most) {
    const double root = x > kFlat * most ? std::sqrt(x) : 0;
    *content *= root;
    return root;
  });
}

inline int width_of(Mode mode) { return mode == kQuadratic ? kBasis : 3; }

// b(q): q, and for quadratic goals the products of its components.
inline void basis_of(const Cluster &c, Mode mode, const double *q, double *b) {
  for (int a = 0; a < 3; ++a) b[a] = q[a];
  if (mode != kQuadratic) return;
  for (int a = 0; a < 3; ++a) {
    b[3 + a] = q[a] * q[a] / c.size - c.mean[a];
    b[6 + a] = q[a] * q[(a + 1) % 3] / c.size - c.mean[3 + a];
  }
}

// Moments of n points whose positions from the center are at(k); mass and size are known.
template <class At>
inline void measure(const At &at, const double *part, uint32_t n, Mode mode, Cluster &c) {
  const int width = width_of(mode);
  double linear[9] = {}, full[kBasis * kBasis] = {}, b[kBasis];
  for (double &m : c.mean) m = 0;
  for (uint32_t k = 0; k < n; ++k) {
    const double *const q = at(k);
    for (int a = 0; a < 3; ++a) {
      c.mean[a] += part[k] * (q[a] * q[a]) / (c.mass * c.size);
      c.mean[3 + a] += part[k] * (q[a] * q[(a + 1) % 3]) / (c.mass * c.size);
      for (int d = 0; d < 3; ++d) linear[3 * a + d] += part[k] * (q[a] * q[d]);
    }
  }
  inverse_of<3>(linear, kFlat, c.linear_inverse);
  if (mode == kLinear) roots_of(linear, c.root_inverse, &c.content);
  if (mode != kQuadratic) return;
  for (uint32_t k = 0; k < n; ++k) {
    basis_of(c, mode, at(k), b);
    for (int i = 0; i < width; ++i)
      for (int j = 0; j < width; ++j) full[kBasis * i + j] += part[k] * (b[i] * b[j]);
  }
  inverse_of<kBasis>(full, kFlat, c.basis_inverse);
}

}  // namespace shape
