// Vectors of three and matrices of nine numbers, row-major.
#pragma once

namespace model {

inline double dot(const double *a, const double *b) { return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]; }
inline double square_between(const double *x, const double *y) {
  const double d[3] = {y[0] - x[0], y[1] - x[1], y[2] - x[2]};
  return dot(d, d);
}
inline void cross(const double *a, const double *b, double *out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}
inline void product(const double *m, const double *x, double *out) {
  for (int i = 0; i < 3; ++i) out[i] = (m[3 * i] * x[0] + m[3 * i + 1] * x[1]) + m[3 * i + 2] * x[2];
}
inline void matrix_product(const double *a, const double *b, double *out) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      out[3 * i + j] = (a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j]) + a[3 * i + 2] * b[6 + j];
}
// a^T b
inline void transposed_matrix_product(const double *a, const double *b, double *out) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out[3 * i + j] = (a[i] * b[j] + a[3 + i] * b[3 + j]) + a[6 + i] * b[6 + j];
}
// The inverse; returns the determinant, which is not zero where the inverse is of use.
inline double invert(const double *m, double *inverse) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
      inverse[3 * c + r] = m[3 * r1 + c1] * m[3 * r2 + c2] - m[3 * r1 + c2] * m[3 * r2 + c1];
    }
  const double det = (m[0] * inverse[0] + m[1] * inverse[3]) + m[2] * inverse[6];
  for (int n = 0; n < 9; ++n) inverse[n] /= det;
  return det;
}

}  // namespace model
