// Closed surfaces with known volumes, for tests of winding numbers and of filling.
#pragma once
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "math/vec3.h"
#include "mesh/mesh.h"

namespace test {

inline dfm::RestMesh surface_of(const std::vector<dfm::Vec3> &points,
                                const std::vector<std::array<uint32_t, 3>> &tris) {
  dfm::RestMesh out;
  for (const dfm::Vec3 &p : points) out.points.insert(out.points.end(), {p.x, p.y, p.z});
  for (const auto &t : tris) out.tris.insert(out.tris.end(), t.begin(), t.end());
  out.tri_group.assign(tris.size(), dfm::kNoGroup);
  for (uint32_t i = 0; i < points.size(); ++i) out.file_point.push_back(i);
  return out;
}

inline dfm::RestMesh box_surface(dfm::Vec3 lo, dfm::Vec3 hi) {
  std::vector<dfm::Vec3> p;
  for (int i = 0; i < 8; ++i) p.push_back({i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z});
  return surface_of(p, {{0, 2, 1},
                        {1, 2, 3},
                        {4, 5, 6},
                        {5, 7, 6},
                        {0, 1, 4},
                        {1, 5, 4},
                        {2, 6, 3},
                        {3, 6, 7},
                        {0, 4, 2},
                        {2, 4, 6},
                        {1, 3, 5},
                        {3, 7, 5}});
}

// Octahedron, each triangle cut into four `cuts` times, pushed out to the sphere.
inline dfm::RestMesh sphere_surface(double radius, int cuts, dfm::Vec3 center = {}) {
  std::vector<dfm::Vec3> p{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<std::array<uint32_t, 3>> t{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                         {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int c = 0; c < cuts; ++c) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middle;
    const auto mid = [&](uint32_t a, uint32_t b) {
      const auto [at, is_new] = middle.try_emplace({std::min(a, b), std::max(a, b)}, uint32_t(p.size()));
      if (is_new) p.push_back(dfm::normalized(p[a] + p[b]));
      return at->second;
    };
    std::vector<std::array<uint32_t, 3>> finer;
    for (const auto &[a, b, d] : t) {
      const uint32_t x = mid(a, b), y = mid(b, d), z = mid(d, a);
      finer.insert(finer.end(), {{a, x, z}, {b, y, x}, {d, z, y}, {x, y, z}});
    }
    t = finer;
  }
  for (dfm::Vec3 &x : p) x = center + radius * x;
  return surface_of(p, t);
}

// About z, `around` quads round the ring and `tube` round its tube.
inline dfm::RestMesh torus_surface(double ring, double radius, uint32_t around, uint32_t tube) {
  std::vector<dfm::Vec3> p;
  std::vector<std::array<uint32_t, 3>> t;
  for (uint32_t i = 0; i < around; ++i)
    for (uint32_t j = 0; j < tube; ++j) {
      const double a = 2 * M_PI * i / around, b = 2 * M_PI * j / tube, r = ring + radius * std::cos(b);
      p.push_back({r * std::cos(a), r * std::sin(a), radius * std::sin(b)});
      const uint32_t k = (i + 1) % around, l = (j + 1) % tube;
      t.push_back({i * tube + j, k * tube + j, k * tube + l});
      t.push_back({i * tube + j, k * tube + l, i * tube + l});
    }
  return surface_of(p, t);
}

inline void append(dfm::RestMesh &to, const dfm::RestMesh &from) {
  const uint32_t first = to.npoint();
  to.points.insert(to.points.end(), from.points.begin(), from.points.end());
  for (const uint32_t i : from.tris) to.tris.push_back(first + i);
  to.tri_group.resize(to.ntri(), dfm::kNoGroup);
  to.file_point.resize(to.npoint());
}

inline void flip(dfm::RestMesh &m, uint32_t t) {
  std::swap(m.tris[3 * size_t(t) + 1], m.tris[3 * size_t(t) + 2]);
}
inline void remove(dfm::RestMesh &m, uint32_t t) {
  m.tris.erase(m.tris.begin() + 3 * t, m.tris.begin() + 3 * t + 3);
  m.tri_group.pop_back();
}

// By the triangles; exact for a clean closed surface.
inline double enclosed(const dfm::RestMesh &m) {
  double v = 0;
  for (size_t t = 0; t < m.tris.size(); t += 3) {
    const auto p = [&](int k) { return dfm::load3(&m.points[3 * size_t(m.tris[t + k])]); };
    v += dot(p(0), cross(p(1), p(2))) / 6;
  }
  return v;
}

}  // namespace test
