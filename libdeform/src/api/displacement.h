// Displacements from the rest shape at the body's pose.
#pragma once
#include "state/body.h"
#include "world/queries.h"

namespace dfm {

inline Vec3 displacement(const Body &b, uint32_t point) {
  return load3(&b.p.x[kStride * size_t{point}]) - place(b.origin.frame, load3(&b.p.rest[size_t{3} * point]));
}
inline Vec3 surfel_displacement(const Body &b, uint32_t s) {
  if (b.surface.identity()) return displacement(b, b.surface.point[s]);
  return surfel_vector(b, b.p.x, s) - place(b.origin.frame, load3(&b.surface.rest[size_t{3} * s]));
}

}  // namespace dfm
