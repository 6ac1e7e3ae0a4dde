// Triangles by their three points, and checks of triangles that a host gives.
#pragma once
#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "core/error.h"
#include "geometry/surface.h"
#include "math/vec3.h"

namespace dfm {

// Def: of a surface or of an obstacle. part: of what in messages.
template <class Def>
void check_triangles(const Def &def, const Named &whose, const char *part) {
  if (def.npoint < 3 || def.ntriangle < 1 || !def.points || !def.triangles)
    refuse(whose, ": its surface has %u points and %u triangles; it needs at least 3 points and 1 triangle",
           def.npoint, def.ntriangle);
  for (uint32_t i = 0; i < def.npoint; ++i)
    if (!all_finite(def.points + size_t{3} * i, 3)) refuse(whose, ": %spoint %u is not finite", part, i);
  for (uint32_t t = 0; t < def.ntriangle; ++t) {
    const uint32_t *const c = def.triangles + size_t{3} * t;
    for (int k = 0; k < 3; ++k)
      if (c[k] >= def.npoint)
        refuse(whose, ": %striangle %u names point %u of %u", part, t, c[k], def.npoint);
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0])
      refuse(whose, ": %striangle %u names a point twice; drop it (dfm_mesh_create does)", part, t);
  }
}

using Corners = std::array<uint32_t, 3>;

inline Corners sorted(uint32_t a, uint32_t b, uint32_t c) {
  Corners out{a, b, c};
  std::sort(out.begin(), out.end());
  return out;
}

class TriangleList {
 public:
  // point(k): of corner k of all triangles
  template <class Point>
  TriangleList(uint32_t ntri, Point &&point) {
    for (uint32_t t = 0; t < ntri; ++t)
      entries_.push_back(
          {sorted(point(3 * size_t{t}), point(3 * size_t{t} + 1), point(3 * size_t{t} + 2)), t});
    std::sort(entries_.begin(), entries_.end());
  }
  uint32_t find(Corners key) const {  // kNone: none
    const auto at = std::lower_bound(entries_.begin(), entries_.end(), std::pair(key, 0u));
    return at != entries_.end() && at->first == key ? at->second : kNone;
  }

 private:
  std::vector<std::pair<Corners, uint32_t>> entries_;
};

}  // namespace dfm
