// Triangles by their three points.
#pragma once
#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "geometry/surface.h"

namespace dfm {

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
