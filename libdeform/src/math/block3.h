// 3x3 matrices, row-major, as nine doubles: the blocks of matrices that couple points.
#pragma once
#include "math/vec3.h"

namespace dfm {

inline Vec3 times3(const double *m, Vec3 a) {
  return {m[0] * a.x + m[1] * a.y + m[2] * a.z, m[3] * a.x + m[4] * a.y + m[5] * a.z,
          m[6] * a.x + m[7] * a.y + m[8] * a.z};
}

inline double determinant3(const double *m) {
  return m[0] * (m[4] * m[8] - m[5] * m[7]) + m[1] * (m[5] * m[6] - m[3] * m[8]) +
         m[2] * (m[3] * m[7] - m[4] * m[6]);
}

inline void inverse3(const double *m, double *out) {
  const double a = m[4] * m[8] - m[5] * m[7], b = m[5] * m[6] - m[3] * m[8], c = m[3] * m[7] - m[4] * m[6];
  const double det = m[0] * a + m[1] * b + m[2] * c;
  const double adjoint[9] = {a, m[2] * m[7] - m[1] * m[8], m[1] * m[5] - m[2] * m[4],
                             b, m[0] * m[8] - m[2] * m[6], m[2] * m[3] - m[0] * m[5],
                             c, m[1] * m[6] - m[0] * m[7], m[0] * m[4] - m[1] * m[3]};
  for (int k = 0; k < 9; ++k) out[k] = adjoint[k] / det;
}

}  // namespace dfm
