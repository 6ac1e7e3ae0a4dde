// What soft bodies see of a geom.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "deform/ode.h"
#include "engine.h"
#include "rigid_host/triangles.h"

namespace dfm_ode_detail {

// All properties that a geom's obstacle follows from, except its pose. Compared in each step, so without
// arrays.
struct Signature {
  int geom_class = -1, inner_class = -1;  // inner: of a geom transform
  double size[3] = {};
  const void *mesh = nullptr;
  int triangles = 0;
  uint32_t category = 0, collides = 0;
  bool enabled = true;
  dBodyID body = nullptr;
  Pose local;                                 // in the body's frame; of a geom without a body: none
  bool operator==(const Signature &o) const;  // but for the filter
  bool has_filter(const Signature &o) const { return category == o.category && collides == o.collides; }
};
Signature signature_of(dGeomID geom);
// of the shape, in the world; a plane: through its nearest point to the origin, z its normal
Pose pose_of(dGeomID geom);

enum class Part { shape, none, needs_arrays, unknown };
Part part_of(const Signature &s);
const char *class_name(int geom_class);

// The shape's kind and sizes; `own`: arrays that the caller gave. Arrays that are made here are put in
// `made`, and def points into them.
void describe(dGeomID geom, const Signature &s, const Triangles *own, dfm_obstacle_def &def, Triangles &made);
Triangles convex_triangles(uint32_t npoint, const double *points, uint32_t npolygon, const uint32_t *polygons,
                           std::string &wrong);
Triangles height_triangles(double width, double depth, uint32_t nx, uint32_t nz, const double *heights);

}  // namespace dfm_ode_detail
