// A gradient as F = R S, and the second derivative of an energy of it in the axes of S (Smith, de Goes and
// Kim 2019, Analytic eigensystems for isotropic distortion energies).
#pragma once
#include <algorithm>

#include "rotation.h"

namespace model {

// R and the symmetric S of F.
inline void split(const double *f, double *r, double (*s)[3]) {
  double product[9];
  rotation::polar_of(f, r);
  transposed_matrix_product(r, f, product);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) s[i][j] = 0.5 * (product[3 * i + j] + product[3 * j + i]);
}

// A block for the stretches, and for the pair of axes other than k its turn against the material's frame and
// its shear.
struct Modes { double stretch[3][3], turn[3], shear[3]; };

// Of St. Venant and Kirchhoff's energy at the stretches s.
inline void venant_modes(double lambda, double mu, const double *s, Modes &out) {
  const double green = 0.5 * lambda * (((s[0] * s[0] + s[1] * s[1]) + s[2] * s[2]) - 3);
  for (int i = 0; i < 3; ++i) {
    const double x = s[(i + 1) % 3], y = s[(i + 2) % 3], squares = x * x + y * y - 1;
    for (int j = 0; j < 3; ++j)
      out.stretch[i][j] = lambda * (s[i] * s[j]) + (i == j ? green + mu * (3 * (s[i] * s[i]) - 1) : 0);
    out.turn[i] = green + mu * (squares - x * y);
    out.shear[i] = green + mu * (squares + x * y);
  }
}

inline void cut_negative(Modes &m) {
  double a[3][3], v[3][3];
  std::copy(&m.stretch[0][0], &m.stretch[0][0] + 9, &a[0][0]);
  jacobi(a, v);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      m.stretch[i][j] = 0;
      for (int k = 0; k < 3; ++k) m.stretch[i][j] += std::max(a[k][k], 0.0) * (v[i][k] * v[j][k]);
    }
  for (int k = 0; k < 3; ++k) {
    m.turn[k] = std::max(m.turn[k], 0.0);
    m.shear[k] = std::max(m.shear[k], 0.0);
  }
}

// The block, row-major, of two points whose gradients are ya and yb in the axes of S.
inline void elastic_block(const Modes &m, const double *ya, const double *yb, double *out) {
  for (int p = 0; p < 3; ++p)
    for (int q = 0; q < 3; ++q) {
      double sum = m.stretch[p][q] * (ya[p] * yb[q]);
      if (p != q) {
        const int k = 3 - p - q;
        sum += 0.5 * (m.shear[k] - m.turn[k]) * (ya[q] * yb[p]);
      } else {
        for (int r = 0; r < 3; ++r)
          if (r != p) sum += 0.5 * (m.shear[3 - p - r] + m.turn[3 - p - r]) * (ya[r] * yb[r]);
      }
      out[3 * p + q] = sum;
    }
}

}  // namespace model
