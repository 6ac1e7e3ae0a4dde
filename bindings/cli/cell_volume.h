#pragma once
#include <cstddef>
#include <cstdint>

namespace cli {

// The volume of a tetrahedron with these corners, m3; negative where it is inverted.
inline double cell_volume(const double *points, const uint32_t *tet) {
  double e[3][3];
  for (size_t k = 0; k < 3; ++k)
    for (size_t c = 0; c < 3; ++c)
      e[k][c] = points[3 * size_t(tet[k + 1]) + c] - points[3 * size_t(tet[0]) + c];
  return (e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
          e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
          e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0])) /
         6;
}

}  // namespace cli
