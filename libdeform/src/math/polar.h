// The rotation of a deformation gradient by Newton's iteration (Higham 1986, Computing the polar
// decomposition, section 3).
#pragma once
#include <cmath>

namespace dfm {

// r = U of f = U P, both row-major. Returns false and leaves r unchanged if f is flat or inverted.
inline bool polar_rotation(const double *f, double *r) {
  constexpr int kIterations = 12;
  constexpr double kFlat = 1e-3;  // of the volume of a cube with the same sum of squares
  constexpr double kConverged = 1e-10;
  double q[9], square = 0;
  for (int k = 0; k < 9; ++k) square += f[k] * f[k];
  if (!(square > 0)) return false;
  const double scale = std::sqrt(3 / square);
  for (int k = 0; k < 9; ++k) q[k] = scale * f[k];
  for (int n = 0; n < kIterations; ++n) {
    const double cofactor[9] = {
        q[4] * q[8] - q[5] * q[7], q[5] * q[6] - q[3] * q[8], q[3] * q[7] - q[4] * q[6],
        q[2] * q[7] - q[1] * q[8], q[0] * q[8] - q[2] * q[6], q[1] * q[6] - q[0] * q[7],
        q[1] * q[5] - q[2] * q[4], q[2] * q[3] - q[0] * q[5], q[0] * q[4] - q[1] * q[3]};
    const double det = (q[0] * cofactor[0] + q[1] * cofactor[1]) + q[2] * cofactor[2];
    if (!(det > kFlat)) return false;
    double change = 0;
    for (int k = 0; k < 9; ++k) {
      const double next = 0.5 * (q[k] + cofactor[k] / det);
      change = std::fmax(change, std::fabs(next - q[k]));
      q[k] = next;
    }
    if (change < kConverged) break;
  }
  for (int k = 0; k < 9; ++k) r[k] = q[k];
  return true;
}

}  // namespace dfm
