// Small closed meshes and scenes of them, for the tests of detection.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "body/make_surface.h"
#include "broad/broad_phase.h"
#include "narrow/narrow_phase.h"

namespace test {

using namespace dfm;

struct Mesh {
  std::vector<double> x;
  std::vector<uint32_t> tri;
  uint32_t add(Vec3 p) {
    x.insert(x.end(), {p.x, p.y, p.z});
    return uint32_t(x.size() / 3 - 1);
  }
  uint32_t npoint() const { return uint32_t(x.size() / 3); }
  uint32_t ntri() const { return uint32_t(tri.size() / 3); }
  Vec3 at(uint32_t i) const { return load3(&x[3 * i]); }
};

// Merges points that lie on each other.
struct Welder {
  Mesh mesh;
  std::map<std::array<long, 3>, uint32_t> seen;
  uint32_t point(Vec3 p) {
    const std::array<long, 3> key{std::lround(p.x * 1e9), std::lround(p.y * 1e9), std::lround(p.z * 1e9)};
    const auto at = seen.find(key);
    if (at != seen.end()) return at->second;
    return seen[key] = mesh.add(p);
  }
  void triangle(Vec3 a, Vec3 b, Vec3 c) {
    for (const Vec3 p : {a, b, c}) mesh.tri.push_back(point(p));
  }
  // Corners counter-clockwise seen from outside; n by m cells.
  void patch(Vec3 o, Vec3 u, Vec3 v, int n, int m) {
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < m; ++j) {
        const auto at = [&](int s, int t) { return o + (double(s) / n) * u + (double(t) / m) * v; };
        triangle(at(i, j), at(i + 1, j), at(i + 1, j + 1));
        triangle(at(i, j), at(i + 1, j + 1), at(i, j + 1));
      }
  }
};

// Box around the origin with edges `size`, n cells along each.
inline Mesh box_mesh(Vec3 size, int nx, int ny, int nz) {
  Welder w;
  const Vec3 h = 0.5 * size, x{size.x, 0, 0}, y{0, size.y, 0}, z{0, 0, size.z};
  w.patch(-h, y, x, ny, nx);
  w.patch(Vec3{-h.x, -h.y, h.z}, x, y, nx, ny);
  w.patch(-h, x, z, nx, nz);
  w.patch(Vec3{-h.x, h.y, -h.z}, z, x, nz, nx);
  w.patch(-h, z, y, nz, ny);
  w.patch(Vec3{h.x, -h.y, -h.z}, y, z, ny, nz);
  return w.mesh;
}

inline Mesh sphere_mesh(double radius, int level) {
  Welder w;
  struct T { Vec3 a, b, c; };
  std::vector<T> t;
  const Vec3 p[6] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (int s = 0; s < 8; ++s) {
    const Vec3 a = p[s & 1], b = p[2 + (s >> 1 & 1)], c = p[4 + (s >> 2 & 1)];
    if (dot(cross(b - a, c - a), a + b + c) > 0) t.push_back({a, b, c});
    else t.push_back({a, c, b});
  }
  for (; level > 0; --level) {
    std::vector<T> next;
    for (const T &f : t) {
      const Vec3 ab = normalized(f.a + f.b), bc = normalized(f.b + f.c), ca = normalized(f.c + f.a);
      for (const T &g : {T{f.a, ab, ca}, T{ab, f.b, bc}, T{ca, bc, f.c}, T{ab, bc, ca}}) next.push_back(g);
    }
    t = next;
  }
  for (const T &f : t) w.triangle(radius * f.a, radius * f.b, radius * f.c);
  return w.mesh;
}

// Closed cylinder along y around the origin; n sides (points by the chord, no transcendental
// accuracy needed).
inline Mesh cylinder_mesh(double radius, double length, int n, int m) {
  Welder w;
  const auto at = [&](int i, double y) {
    const double a = 2 * M_PI * (i % n) / n;
    return Vec3{radius * std::cos(a), y, radius * std::sin(a)};
  };
  const Vec3 lo{0, -length / 2, 0}, hi{0, length / 2, 0};
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      const double y0 = -length / 2 + length * j / m, y1 = -length / 2 + length * (j + 1) / m;
      w.triangle(at(i, y0), at(i, y1), at(i + 1, y1));
      w.triangle(at(i, y0), at(i + 1, y1), at(i + 1, y0));
    }
    w.triangle(lo, at(i, lo.y), at(i + 1, lo.y));
    w.triangle(hi, at(i + 1, hi.y), at(i, hi.y));
  }
  return w.mesh;
}

inline Mesh tetrahedron_mesh(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  Mesh m;
  for (const Vec3 p : {a, b, c, d}) m.add(p);
  if (dot(cross(b - a, c - a), d - a) > 0) m.tri = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
  else m.tri = {0, 1, 2, 0, 3, 1, 1, 3, 2, 2, 3, 0};
  return m;
}

inline Mesh moved(Mesh m, Quat q, Vec3 shift) {
  for (uint32_t i = 0; i < m.npoint(); ++i) store3(&m.x[3 * i], rotate(q, m.at(i)) + shift);
  return m;
}

inline Quat turn(Vec3 axis, double angle) {
  const Vec3 a = std::sin(angle / 2) * normalized(axis);
  return {a.x, a.y, a.z, std::cos(angle / 2)};
}

struct Scene {
  std::vector<std::unique_ptr<Surface>> surfaces;
  std::vector<BodyView> bodies;
  std::vector<ObstacleView> obstacles;
  PairFilter filter;
  double h = 1e-3, offset = 1e-3;

  Surface &add(const Mesh &m, Vec3 velocity = {}) {
    surfaces.push_back(std::make_unique<Surface>());
    Surface &s = *surfaces.back();
    make_surface(Memory::standard(), m.npoint(), m.x.data(), m.tri.data(), m.ntri(), s);
    for (uint32_t i = 0; i < s.nsurfel; ++i) store3(&s.v[4 * i], velocity);
    uint32_t first = 0;
    for (const auto &b : bodies) first += b.surface->nsurfel;
    bodies.push_back({uint32_t(bodies.size()), first, 1, ~0u, 100 + bodies.size(), &s});
    return s;
  }
  ObstacleView &add(Shape shape, Vec3 position, Quat rotation = {}) {
    ObstacleView o{};
    o.slot = uint32_t(obstacles.size());
    o.id = 100 + obstacles.size();
    o.category = 1;
    o.collides_with = ~0u;
    o.shape = shape;
    o.position = position;
    o.rotation = rotation;
    obstacles.push_back(o);
    return obstacles.back();
  }

  // All pairs of features, in the order of BroadPhase.
  Array<Candidate> all() const {
    Array<Candidate> c;
    std::vector<BodyView> by_id(bodies);
    std::sort(by_id.begin(), by_id.end(), [](const BodyView &l, const BodyView &r) { return l.id < r.id; });
    for (const BodyView &a : by_id) {
      const Surface &s = *a.surface;
      for (const BodyView &b : by_id) {
        if (a.id == b.id || !filter.may_touch(a, b)) continue;
        for (uint32_t i = 0; i < s.nsurfel; ++i)
          for (uint32_t j = 0; j < b.surface->ntri; ++j) c.push_back({a.slot, b.slot, i, j, 0, 0});
        if (a.id > b.id) continue;
        for (uint32_t i = 0; i < s.nedge; ++i)
          for (uint32_t j = 0; j < b.surface->nedge; ++j) c.push_back({a.slot, b.slot, i, j, 1, 0});
      }
      for (const ObstacleView &o : obstacles) {
        if (!filter.may_touch(a, o)) continue;
        const bool surfels_alone = o.shape == Shape::plane && s.bulge.empty();
        const uint32_t count[3] = {s.nsurfel, surfels_alone ? 0 : s.nedge, surfels_alone ? 0 : s.ntri};
        for (uint8_t k = 0; k < 3; ++k)
          for (uint32_t i = 0; i < count[k]; ++i) c.push_back({a.slot, o.slot, i, 0, k, 1});
      }
    }
    return c;
  }
  Array<ContactPoint> contacts(const Array<Candidate> &c, std::span<const Crossing> crossings = {}) const {
    Array<ContactPoint> out;
    Array<uint8_t> lent;
    find_contacts(bodies, obstacles, c, h, offset, crossings, lent, out);
    return out;
  }
  Array<ContactPoint> contacts() const { return contacts(all()); }
  // By way of the broad phase, where all pairs would be too many.
  Array<ContactPoint> listed() const {
    BroadPhase broad(Memory::standard());
    broad.update(bodies, obstacles, filter, h, offset);
    return contacts(broad.candidates());
  }
};

inline bool same_bits(const Array<ContactPoint> &a, const Array<ContactPoint> &b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(ContactPoint)) == 0);
}

// What every set of contacts must satisfy; empty if it does.
inline std::string flaw(const Scene &scene, const Array<ContactPoint> &contacts) {
  std::vector<uint64_t> keys;
  std::vector<Vec3> at;
  std::vector<double> sizes;
  for (const BodyView &b : scene.bodies)
    for (uint32_t s = 0; s < b.surface->nsurfel; ++s) at.push_back(load3(&b.surface->x[4 * s]));
  const auto order = [&](const ContactPoint &c) {
    const uint64_t id_b = c.obstacle ? scene.obstacles[c.slot_b].id : scene.bodies[c.slot_b].id;
    return std::array<uint64_t, 7>{
        scene.bodies[c.slot_a].id, c.obstacle, id_b, c.kind, c.type_a, c.feature_a, c.feature_b};
  };
  for (size_t i = 0; i < contacts.size(); ++i) {
    const ContactPoint &c = contacts[i];
    const std::string which = "contact " + std::to_string(i) + ": ";
    if (i && !(order(contacts[i - 1]) < order(c))) return which + "out of order";
    keys.push_back(c.key);
    if (std::fabs(norm(load3(c.normal)) - 1) > 1e-12) return which + "normal is not a unit vector";
    if (!std::isfinite(c.distance) || !(c.area >= 0) || c.nnode < 1 || c.nnode > 4)
      return which + "not finite, or bad counts";
    double sum[2] = {0, 0};
    Vec3 side[2];
    for (int k = 0; k < c.nnode; ++k) {
      const uint32_t first = scene.bodies[c.slot_a].first_node, n = scene.bodies[c.slot_a].surface->nsurfel;
      const int s = c.node[k] >= first && c.node[k] < first + n ? 0 : 1;
      sum[s] += c.weight[k];
      side[s] += c.weight[k] * at[c.node[k]];
      // An edge may count as up to a quarter longer for what slides in over its ends; a bulge has a fourth
      // surfel.
      if (s == 0 && !(c.obstacle && c.nnode == 4) &&
          !(c.weight[k] > (c.kind == kEdgeEdge || (c.obstacle && c.type_a == 1) ? -0.25 : 0.0)))
        return which + "weight of side a is out of range";
    }
    if (std::fabs(sum[0] - 1) > 1e-12 || std::fabs(sum[1] + (c.obstacle ? 0 : 1)) > 1e-12)
      return which + "weights do not sum to one";
    // No torque: the two points where the force acts lie on the line of the normal.
    if (!c.obstacle) {
      const Vec3 r = side[0] + side[1] - c.distance * load3(c.normal);
      if (norm(r) > 1e-9 * (1 + norm(side[0]))) return which + "points are not on the normal's line";
    }
  }
  std::sort(keys.begin(), keys.end());
  if (std::adjacent_find(keys.begin(), keys.end()) != keys.end()) return "two contacts have one key";
  return {};
}

}  // namespace test
