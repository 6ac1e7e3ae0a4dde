// An axis-parallel box that grows with the points that are added to it.
#pragma once
#include <algorithm>
#include <cmath>

#include "math/vec3.h"

namespace dfm {

struct Extent {
  Vec3 lo{HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  void add(Vec3 x) {
    lo = {std::min(lo.x, x.x), std::min(lo.y, x.y), std::min(lo.z, x.z)};
    hi = {std::max(hi.x, x.x), std::max(hi.y, x.y), std::max(hi.z, x.z)};
  }
  // Along an axis; 0 without points.
  double longest() const {
    const Vec3 size = hi - lo;
    return std::max({0.0, size.x, size.y, size.z});
  }
  double diagonal() const { return norm(hi - lo); }
  int longest_axis() const {  // the first of equal ones
    const Vec3 size = hi - lo;
    return size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  }
  void grow(Vec3 by) {
    lo = lo - by;
    hi = hi + by;
  }
  // Whether the two are at most `reach` apart along every axis.
  bool meets(const Extent &o, double reach = 0) const {
    for (int k = 0; k < 3; ++k)
      if (hi[k] + reach < o.lo[k] || o.hi[k] + reach < lo[k]) return false;
    return true;
  }
};

// The extent of points [n,3].
template <class Points>
Extent extent_of(const Points &points) {
  Extent box;
  for (size_t i = 0; i < points.size(); i += 3) box.add(load3(&points[i]));
  return box;
}

}  // namespace dfm
