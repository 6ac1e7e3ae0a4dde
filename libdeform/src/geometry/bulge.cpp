#include "geometry/bulge.h"

#include <algorithm>
#include <cmath>

#include "math/trig.h"

namespace dfm {
namespace {

struct Maker {
  Surface &s;
  double cosine;
  Array<Vec3> face;  // twice the areas, along the normals

  Vec3 x(uint32_t i) const { return load3(&s.x[4 * size_t{i}]); }
  bool smooth(uint32_t t, uint32_t o) const {
    return dot(face[t], face[o]) >= cosine * norm(face[t]) * norm(face[o]);
  }
  // Exact where the corner and its neighbors lie on a sphere (Max 1999).
  Vec3 normal(uint32_t t, uint32_t corner) const {
    Vec3 sum;
    for (uint32_t i = s.fan_begin[corner]; i < s.fan_begin[corner + 1]; ++i) {
      const uint32_t *const c = &s.tri[3 * size_t{s.fan[i]}];
      const int k = c[0] == corner ? 0 : c[1] == corner ? 1 : 2;
      const double size = norm2(x(c[(k + 1) % 3]) - x(corner)) * norm2(x(c[(k + 2) % 3]) - x(corner));
      if (size > 0 && smooth(t, s.fan[i])) sum += (1 / size) * face[s.fan[i]];
    }
    return normalized(sum);
  }
  // The surfel of the smooth faces around a triangle that lies deepest below its plane.
  double deepest(uint32_t t, Vec3 outward, uint32_t &surfel) const {
    const uint32_t *const c = &s.tri[3 * size_t{t}];
    double most = 0;
    for (int k = 0; k < 3; ++k)
      for (uint32_t i = s.fan_begin[c[k]]; i < s.fan_begin[c[k] + 1]; ++i) {
        if (!smooth(t, s.fan[i])) continue;
        for (int j = 0; j < 3; ++j) {
          const uint32_t o = s.tri[3 * size_t{s.fan[i]} + j];
          const double depth = dot(outward, x(c[0]) - x(o));
          if (!(depth > most)) continue;
          most = depth;
          surfel = o;
        }
      }
    return most;
  }
  void make(uint32_t t) {
    const uint32_t *const c = &s.tri[3 * size_t{t}];
    const Vec3 outward = normalized(face[t]);
    Vec3 off[3];
    double rise = 0;
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      const Vec3 edge = x(c[next]) - x(c[k]), m = normal(t, c[k]), n = normal(t, c[next]);
      off[k] = 0.125 * (dot(n, edge) * n - dot(m, edge) * m);
      rise = std::max(rise, dot(outward, off[k]));
    }
    uint32_t from = kNone;
    // A patch rises less than its neighbors fall off, if the mesh has any share in its curve.
    if (!(rise > 0) || !(deepest(t, outward, from) >= rise)) return;
    const Vec3 a = x(c[1]) - x(c[0]), b = x(c[2]) - x(c[0]), o = x(from) - x(c[0]);
    const double det = dot(cross(a, b), o);
    for (int k = 0; k < 3; ++k)
      store3(&s.bulge[9 * size_t{t} + 3 * size_t(k)],
             (1 / det) * Vec3{dot(cross(off[k], b), o), dot(cross(a, off[k]), o), dot(cross(a, b), off[k])});
    s.bulge_from[t] = from;
    const double middle[3] = {1.0 / 3, 1.0 / 3, 1.0 / 3};
    double w[4], sum = 0;
    Patch(s, t).weights(middle, w);
    for (const double weight : w) sum += std::fabs(weight);
    s.bulge_sum = std::max(s.bulge_sum, sum);
  }
};

}  // namespace

void make_bulges(Surface &surface, double degrees) {
  surface.bulge_from = Array<uint32_t>(surface.ntri, kNone, surface.tri.get_allocator());
  surface.bulge = Array<double>(size_t{9} * surface.ntri, 0.0, surface.x.get_allocator());
  surface.bulge_sum = 1;
  Maker maker{surface, sin_turns(0.25 - degrees / 360),
              Array<Vec3>(surface.ntri, Vec3{}, HookAllocator<Vec3>(*surface.tri.get_allocator().memory))};
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
  return at > 0 && at < 1;
}

bool PatchHeights::lowest_inside(double u[3]) const {
  const double f00 = -8 * off[2], f11 = -8 * off[1], f01 = 4 * (off[0] - off[1] - off[2]);
  const double g0 = corner[0] - corner[2] + 4 * off[2], g1 = corner[1] - corner[2] + 4 * off[1];
  const double det = f00 * f11 - f01 * f01;
  if (!(f00 > 0 && f11 > 0 && det > 0)) return false;
  u[0] = (f01 * g1 - f11 * g0) / det;
  u[1] = (f01 * g0 - f00 * g1) / det;
  u[2] = 1 - u[0] - u[1];
  return u[0] > 0 && u[1] > 0 && u[2] > 0;
}

}  // namespace dfm
