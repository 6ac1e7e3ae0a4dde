#include "geometry/bulge.h"

#include <algorithm>
#include <cmath>

#include "math/elementary.h"

namespace dfm {
namespace {

struct Maker {
  Surface &s;
  double cosine;
  Array<Vec3> face;  // twice the areas, along the normals
  Array<uint32_t> group;

  Vec3 x(uint32_t i) const { return load3(&s.x[4 * size_t{i}]); }
  bool smooth(uint32_t edge) const {
    const uint32_t *const sides = &s.edge_tri[2 * size_t{edge}];
    if (sides[0] == kNone || sides[1] == kNone) return false;
    const Vec3 m = face[sides[0]], n = face[sides[1]];
    return dot(m, n) >= cosine * norm(m) * norm(n);
  }
  // The triangles at a corner of t that smooth edges there join to t, itself first.
  void join(uint32_t t, uint32_t corner) {
    group.assign(1, t);
    for (size_t i = 0; i < group.size(); ++i)
      for (int k = 0; k < 3; ++k) {
        const uint32_t edge = s.tri_edge[3 * size_t{group[i]} + size_t(k)];
        if ((s.edge[2 * size_t{edge}] != corner && s.edge[2 * size_t{edge} + 1] != corner) || !smooth(edge))
          continue;
        const uint32_t *const sides = &s.edge_tri[2 * size_t{edge}];
        const uint32_t next = sides[0] == group[i] ? sides[1] : sides[0];
        if (std::find(group.begin(), group.end(), next) == group.end()) group.push_back(next);
      }
  }
  // The normal of the joined triangles at a corner; exact where the corner and its neighbors lie on a sphere
  // (Max 1999).
  Vec3 normal(uint32_t corner) const {
    Vec3 sum;
    for (const uint32_t t : group) {
      const uint32_t *const c = &s.tri[3 * size_t{t}];
      const int k = c[0] == corner ? 0 : c[1] == corner ? 1 : 2;
      const double size = norm2(x(c[(k + 1) % 3]) - x(corner)) * norm2(x(c[(k + 2) % 3]) - x(corner));
      if (size > 0) sum += (1 / size) * face[t];
    }
    return normalized(sum);
  }
  // The surfel of the joined triangles that lies deepest below a plane.
  void deepest(Vec3 on, Vec3 outward, double &most, uint32_t &surfel) const {
    for (const uint32_t t : group)
      for (int k = 0; k < 3; ++k) {
        const uint32_t o = s.tri[3 * size_t{t} + size_t(k)];
        const double depth = dot(outward, on - x(o));
        if (!(depth > most)) continue;
        most = depth;
        surfel = o;
      }
  }
  void make(uint32_t t) {
    const uint32_t *const c = &s.tri[3 * size_t{t}];
    const Vec3 outward = normalized(face[t]);
    Vec3 normals[3], off[3];
    double rise = 0, depth = 0;
    uint32_t from = kNone;
    for (int k = 0; k < 3; ++k) {
      join(t, c[k]);
      normals[k] = normal(c[k]);
      deepest(x(c[0]), outward, depth, from);
    }
    for (int k = 0; k < 3; ++k) {
      const Vec3 edge = x(c[(k + 1) % 3]) - x(c[k]), m = normals[k], n = normals[(k + 1) % 3];
      off[k] = 0.125 * (dot(n, edge) * n - dot(m, edge) * m);
      rise = std::max(rise, dot(outward, off[k]));
    }
    // A patch rises less than its neighbors fall off, if the mesh has any share in its curve.
    if (!(rise > 0) || !(depth >= rise)) return;
    const Vec3 a = x(c[1]) - x(c[0]), b = x(c[2]) - x(c[0]), o = x(from) - x(c[0]);
    const double det = dot(cross(a, b), o);
    s.bulge_from[t] = from;
    for (int k = 0; k < 3; ++k) {
      const Vec3 w =
          (1 / det) * Vec3{dot(cross(off[k], b), o), dot(cross(a, off[k]), o), dot(cross(a, b), off[k])};
      store3(&s.bulge[9 * size_t{t} + 3 * size_t(k)], w);
      const double sum = std::fabs(w.x) + std::fabs(w.y) + std::fabs(w.z) + std::fabs(w.x + w.y + w.z);
      s.bulge_sum = std::max(s.bulge_sum, 1 + 4.0 / 3 * sum);
    }
  }
};

}  // namespace

void make_bulges(Surface &surface, double degrees) {
  surface.bulge_from = Array<uint32_t>(surface.ntri, kNone, surface.tri.get_allocator());
  surface.bulge = Array<double>(size_t{9} * surface.ntri, 0.0, surface.x.get_allocator());
  surface.bulge_sum = 1;
  Maker maker{surface, dfm_cospi(degrees / 180),
              Array<Vec3>(surface.ntri, Vec3{}, *surface.tri.get_allocator().memory),
              Array<uint32_t>(surface.tri.get_allocator())};
  for (uint32_t t = 0; t < surface.ntri; ++t)
    maker.face[t] = surface.area2(t, [&](uint32_t i) { return maker.x(i); });
  for (uint32_t t = 0; t < surface.ntri; ++t) maker.make(t);
}

bool PatchHeights::lowest_of_edge(int k, double u[3]) const {
  const int next = (k + 1) % 3;
  if (!(off[k] < 0)) return false;
  const double at = 0.5 + (corner[next] - corner[k]) / (8 * off[k]);
  u[k] = 1 - at;
  u[next] = at;
  u[(k + 2) % 3] = 0;
  return true;
}

bool PatchHeights::lowest(double u[3]) const {
  const double f00 = -8 * off[2], f11 = -8 * off[1], f01 = 4 * (off[0] - off[1] - off[2]);
  const double g0 = corner[0] - corner[2] + 4 * off[2], g1 = corner[1] - corner[2] + 4 * off[1];
  const double det = f00 * f11 - f01 * f01;
  if (!(f00 > 0 && f11 > 0 && det > 0)) return false;
  u[0] = (f01 * g1 - f11 * g0) / det;
  u[1] = (f01 * g0 - f00 * g1) / det;
  u[2] = 1 - u[0] - u[1];
  return true;
}

}  // namespace dfm
