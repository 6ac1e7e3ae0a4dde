// The tetrahedron with linear shape functions: gradients and volume at rest. Deformation gradient of
// positions x_a: F = sum_a x_a (x) g_a. Its stiffness is B^T D B V with B from the same gradients.
#pragma once
#include <cmath>
#include <cstdint>

namespace model {

struct Tetrahedron {
  double volume;   // m^3, signed as the corners are ordered
  double g[4][3];  // gradients of the shape functions at rest, 1/m; |g_a| is one over the height of corner a
};

// False where the corners span no volume: |volume| at most 1e-12 of the cube of the longest edge from
// corner 0 (gradients are then zero).
inline bool make_tetrahedron(const double *x0, const double *x1, const double *x2, const double *x3,
                             Tetrahedron &out) {
  double e[3][3], longest = 0;
  const double *const corner[3] = {x1, x2, x3};
  for (int k = 0; k < 3; ++k) {
    double square = 0;
    for (int a = 0; a < 3; ++a) {
      e[k][a] = corner[k][a] - x0[a];
      square += e[k][a] * e[k][a];
    }
    longest = square > longest ? square : longest;
  }
  double cross[3][3];
  for (int k = 0; k < 3; ++k) {
    const double *const u = e[(k + 1) % 3], *const w = e[(k + 2) % 3];
    cross[k][0] = u[1] * w[2] - u[2] * w[1];
    cross[k][1] = u[2] * w[0] - u[0] * w[2];
    cross[k][2] = u[0] * w[1] - u[1] * w[0];
  }
  const double six = (e[0][0] * cross[0][0] + e[0][1] * cross[0][1]) + e[0][2] * cross[0][2];
  out.volume = six / 6;
  const bool solid = std::fabs(six) > 6e-12 * (longest * std::sqrt(longest));
  for (int a = 0; a < 3; ++a) {
    for (int k = 0; k < 3; ++k) out.g[k + 1][a] = solid ? cross[k][a] / six : 0;
    out.g[0][a] = -((out.g[1][a] + out.g[2][a]) + out.g[3][a]);
  }
  return solid;
}

// Block (a, b) of the stiffness, V B_a^T D B_b row-major: the force that a displacement of corner b calls
// for at corner a, with the sign of K. D as in material.h.
inline void stiffness_block(const Tetrahedron &t, const double (*d)[6], int a, int b, double *out) {
  constexpr int kVoigt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      double sum = 0;
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l) sum += d[kVoigt[i][k]][kVoigt[j][l]] * (t.g[a][k] * t.g[b][l]);
      out[3 * i + j] = t.volume * sum;
    }
}

}  // namespace model
