// Triangle obstacles that tests build: floors of irregular triangles, wedges, boxes.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "stack.h"

namespace test {

struct Triangles {
  std::vector<double> points;
  std::vector<uint32_t> tris;
};

// z = height(x, y) over [-size, size]^2, n by n squares whose inner corners are moved about and whose
// diagonals alternate without a pattern.
inline Triangles height_field(double size, uint32_t n, const std::function<double(double, double)> &height,
                              double disorder = 0.3) {
  Triangles m;
  uint64_t seed = 12345;
  const auto next = [&] {
    seed = seed * 6364136223846793005ull + 1442695040888963407ull;
    return double(seed >> 11) / 9007199254740992.0;
  };
  for (uint32_t j = 0; j <= n; ++j)
    for (uint32_t i = 0; i <= n; ++i) {
      const bool inner = i > 0 && j > 0 && i < n && j < n;
      const double cell = 2 * size / n;
      const double x = -size + cell * (i + (inner ? disorder * (2 * next() - 1) : 0));
      const double y = -size + cell * (j + (inner ? disorder * (2 * next() - 1) : 0));
      m.points.insert(m.points.end(), {x, y, height(x, y)});
    }
  for (uint32_t j = 0; j < n; ++j)
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      if (next() < 0.5) m.tris.insert(m.tris.end(), {a, b, d, a, d, c});
      else m.tris.insert(m.tris.end(), {a, b, c, b, d, c});
    }
  return m;
}

// Closed box about the origin, each face of n by n squares.
inline Triangles box_surface(std::array<double, 3> half, uint32_t n) {
  Triangles m;
  const auto point = [&](std::array<double, 3> p) {
    for (uint32_t i = 0; i < m.points.size() / 3; ++i)
      if (std::fabs(m.points[3 * i] - p[0]) + std::fabs(m.points[3 * i + 1] - p[1]) +
              std::fabs(m.points[3 * i + 2] - p[2]) <
          1e-9 * half[0])
        return i;
    m.points.insert(m.points.end(), p.begin(), p.end());
    return uint32_t(m.points.size() / 3 - 1);
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side = -1; side <= 1; side += 2)
      for (uint32_t i = 0; i < n; ++i)
        for (uint32_t j = 0; j < n; ++j) {
          uint32_t q[4];
          for (int k = 0; k < 4; ++k) {
            std::array<double, 3> p{};
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            p[size_t(axis)] = side * half[size_t(axis)];
            p[size_t(u)] = half[size_t(u)] * (2.0 * (i + (k == 1 || k == 2)) / n - 1);
            p[size_t(v)] = half[size_t(v)] * (2.0 * (j + (k >= 2)) / n - 1);
            q[k] = point(p);
          }
          if (side > 0) m.tris.insert(m.tris.end(), {q[0], q[1], q[2], q[0], q[2], q[3]});
          else m.tris.insert(m.tris.end(), {q[0], q[2], q[1], q[0], q[3], q[2]});
        }
  return m;
}

inline Triangles inside_out(Triangles m) {
  for (size_t i = 0; i < m.tris.size(); i += 3) std::swap(m.tris[i], m.tris[i + 1]);
  return m;
}

inline dfm_obstacle_def mesh_def(const char *name, const Triangles &m, uint32_t shape = DFM_SHAPE_MESH,
                                 uint32_t cells = 0) {
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = name;
  d.shape = shape;
  d.npoint = uint32_t(m.points.size() / 3);
  d.ntriangle = uint32_t(m.tris.size() / 3);
  d.points = m.points.data();
  d.triangles = m.tris.data();
  d.cells = cells;
  return d;
}

inline dfm_obstacle add_mesh(dfm_world w, const char *name, const Triangles &m,
                             uint32_t shape = DFM_SHAPE_MESH, uint32_t cells = 0) {
  const dfm_obstacle_def d = mesh_def(name, m, shape, cells);
  dfm_obstacle o = 0;
  ok(dfm_obstacle_create(w, &d, &o));
  return o;
}

}  // namespace test
