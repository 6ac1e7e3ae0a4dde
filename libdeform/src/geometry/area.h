// Areas and volumes of surfaces.
#pragma once
#include <span>

#include "geometry/surface.h"
#include "math/vec3.h"

namespace dfm {

// The area of a surfel in a contact, m2: a third of the triangles around it, projected along the contact
// normal, so that the areas of a patch in full contact add up to its area, and faces next to its rim do not
// count. outward: unit normal of the surfel's body at the contact.
inline double facing_area(const Surface &surface, uint32_t surfel, Vec3 outward) {
  const auto x = [&](uint32_t s) { return load3(&surface.x[4 * size_t{s}]); };
  double sum = 0;
  for (uint32_t k = surface.fan_begin[surfel]; k < surface.fan_begin[surfel + 1]; ++k) {
    const uint32_t *const c = &surface.tri[3 * size_t{surface.fan[k]}];
    const double part = dot(outward, cross(x(c[1]) - x(c[0]), x(c[2]) - x(c[0])));
    if (part > 0) sum += part;
  }
  return sum / 6;
}

// m3, inside of a closed surface; negative where it faces inward. tri: [ntri,3]; at(i): the place of point i.
template <class At>
double signed_volume(std::span<const uint32_t> tri, At &&at) {
  const Vec3 origin = at(0);
  double sum = 0;
  for (size_t t = 0; t < tri.size(); t += 3)
    sum += dot(at(tri[t]) - origin, cross(at(tri[t + 1]) - origin, at(tri[t + 2]) - origin)) / 6;
  return sum;
}

}  // namespace dfm
