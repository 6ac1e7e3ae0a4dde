#include "geometry/ellipsoid.h"

#include <algorithm>
#include <map>

namespace dfm {

EllipsoidMesh ellipsoid_mesh(Vec3 half_axes, uint32_t refinements) {
  const double g = 0.5 * (1 + std::sqrt(5.0));  // golden ratio
  std::vector<Vec3> x = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                         {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (Vec3 &p : x) p = normalized(p);
  std::vector<uint32_t> tri = {0, 11, 5,  0, 5,  1, 0, 1, 7, 0, 7,  10, 0, 10, 11, 1, 5, 9, 5, 11,
                               4, 11, 10, 2, 10, 7, 6, 7, 1, 8, 3,  9,  4, 3,  4,  2, 3, 2, 6, 3,
                               6, 8,  3,  8, 9,  4, 9, 5, 2, 4, 11, 6,  2, 10, 8,  6, 7, 9, 8, 1};
  for (uint32_t k = 0; k < refinements; ++k) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middle;
    const auto between = [&](uint32_t a, uint32_t b) {
      const auto [at, fresh] = middle.try_emplace(std::minmax(a, b), static_cast<uint32_t>(x.size()));
      if (fresh) x.push_back(normalized(x[a] + x[b]));
      return at->second;
    };
    std::vector<uint32_t> finer;
    for (size_t t = 0; t < tri.size(); t += 3) {
      const uint32_t a = tri[t], b = tri[t + 1], c = tri[t + 2];
      const uint32_t ab = between(a, b), bc = between(b, c), ca = between(c, a);
      finer.insert(finer.end(), {a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca});
    }
    tri = std::move(finer);
  }
  EllipsoidMesh out;
  for (const Vec3 &p : x)
    out.points.insert(out.points.end(), {half_axes.x * p.x, half_axes.y * p.y, half_axes.z * p.z});
  out.triangles = std::move(tri);
  return out;
}

}  // namespace dfm
