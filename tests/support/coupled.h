// Bodies that wear a surface of their own, finer than their cells.
#pragma once
#include <map>

#include "world.h"

namespace test {

struct Skin {
  std::vector<double> points;
  std::vector<uint32_t> triangles;
  uint32_t npoint() const { return uint32_t(points.size() / 3); }
  dfm_surface_def def(int32_t coupling = DFM_COUPLING_BARYCENTRIC, double support = 0) const {
    return {sizeof(dfm_surface_def), coupling,         npoint(), uint32_t(triangles.size() / 3),
            points.data(),           triangles.data(), support};
  }
};

namespace detail {

using Point = std::array<double, 3>;
struct Weld {
  Skin skin;
  std::map<std::array<long, 3>, uint32_t> seen;
  void corner(Point p) {
    const std::array<long, 3> key{std::lround(p[0] * 1e9), std::lround(p[1] * 1e9), std::lround(p[2] * 1e9)};
    const auto [at, fresh] = seen.emplace(key, skin.npoint());
    if (fresh) skin.points.insert(skin.points.end(), p.begin(), p.end());
    skin.triangles.push_back(at->second);
  }
  void triangle(Point a, Point b, Point c) {
    corner(a);
    corner(b);
    corner(c);
  }
};

}  // namespace detail

// A box from the origin, n cells along each side of each face.
inline Skin box_skin(std::array<double, 3> size, int n) {
  detail::Weld w;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const auto at = [&](int i, int j) {
        detail::Point p{};
        p[axis] = side * size[axis];
        p[u] = size[u] * i / n;
        p[v] = size[v] * j / n;
        return p;
      };
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const auto a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
          if (side) {
            w.triangle(a, b, c);
            w.triangle(a, c, d);
          } else {
            w.triangle(a, c, b);
            w.triangle(a, d, c);
          }
        }
    }
  return w.skin;
}

// A sphere about the origin: an octahedron cut `level` times.
inline Skin ball_skin(double radius, int level) {
  using P = detail::Point;
  struct T { P a, b, c; };
  const auto half = [](P a, P b) {
    P m{a[0] + b[0], a[1] + b[1], a[2] + b[2]};
    const double l = std::sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
    for (double &x : m) x /= l;
    return m;
  };
  std::vector<T> t;
  for (int s = 0; s < 8; ++s) {
    const double x = s & 1 ? -1 : 1, y = s & 2 ? -1 : 1, z = s & 4 ? -1 : 1;
    if (x * y * z > 0) t.push_back({{x, 0, 0}, {0, y, 0}, {0, 0, z}});
    else t.push_back({{x, 0, 0}, {0, 0, z}, {0, y, 0}});
  }
  for (; level > 0; --level) {
    std::vector<T> next;
    for (const T &f : t) {
      const P ab = half(f.a, f.b), bc = half(f.b, f.c), ca = half(f.c, f.a);
      for (const T &g : {T{f.a, ab, ca}, T{ab, f.b, bc}, T{ca, bc, f.c}, T{ab, bc, ca}}) next.push_back(g);
    }
    t = next;
  }
  detail::Weld w;
  for (T f : t) {
    for (P *p : {&f.a, &f.b, &f.c})
      for (double &x : *p) x *= radius;
    w.triangle(f.a, f.b, f.c);
  }
  return w.skin;
}

inline std::vector<double> surface_positions(dfm_body b) { return listed(dfm_surface_positions, b, 3); }
inline std::vector<uint32_t> surface_triangles(dfm_body b) { return listed(dfm_surface_triangles, b, 3); }
// The body's own boundary as a surface of its own: the same thing through the matrix.
inline Skin boundary_skin(dfm_body b) { return {surface_positions(b), surface_triangles(b)}; }

}  // namespace test
