// Queries of the present state that steps do not need: surface vectors and normals, rays, closest points.
#pragma once
#include "geometry/triangle_search.h"
#include "state/body.h"

namespace dfm {

struct World;
struct Obstacle;

// The tree of a body's surface, in the world frame; of a mesh or voxel obstacle, in its own frame, where its
// points never change. Voxels use the surface that they were made from.
Triangles search(Body &b);
Triangles search(Obstacle &ob);
Vec3 normal_of(const Triangles &triangles, uint32_t triangle);
// Distance of an obstacle without triangles along a ray, or infinity, and the normal there. From inside it is
// the point where the ray leaves.
double ray_obstacle(const Obstacle &ob, Vec3 origin, Vec3 unit_direction, Vec3 *normal);

// Displacements from the rest shape at the body's pose.
inline Vec3 displacement(const Body &b, uint32_t point) {
  return b.p.x_at(point) - place(b.origin.frame, b.p.rest_at(point));
}
inline Vec3 surfel_at_rest(const Body &b, uint32_t s) {
  return place(b.origin.frame, b.surface.identity() ? b.p.rest_at(b.surface.point[s])
                                                    : load3(&b.surface.rest[size_t{3} * s]));
}
inline Vec3 surfel_displacement(const Body &b, uint32_t s) {
  if (b.surface.identity()) return displacement(b, b.surface.point[s]);
  return b.surface.sum(s, b.p.x.data()) - surfel_at_rest(b, s);
}
// [nsurfel,3], area-weighted
void surface_normals(const Body &b, double *out);
TriangleNearPoint closest_on_body(Body &b, Vec3 p);  // by squared distance

}  // namespace dfm
