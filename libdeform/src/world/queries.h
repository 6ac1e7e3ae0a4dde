// Questions about the present state that no step needs: surface vectors and normals, rays, closest points.
#pragma once
#include "geometry/triangle_search.h"
#include "state/body.h"

namespace dfm {

struct World;

// N times a column of the phyxels
Vec3 surfel_vector(const Body &b, const Array<double> &phyxel_column, uint32_t surfel);
// [nsurfel,3], area-weighted
void surface_normals(const Body &b, double *out);
// Several threads may ask at once. The first who asks after positions have changed renews the trees
// (state/search_tree.h); a later one allocates nothing.
dfm_ray_hit cast_ray(World &w, Vec3 origin, Vec3 unit_direction, double max_distance,
                     SearchCount *count = nullptr);
dfm_ray_hit closest_surface(World &w, Vec3 p, double max_distance, SearchCount *count = nullptr);
TriangleNearPoint closest_on_body(Body &b, Vec3 p);  // by squared distance

}  // namespace dfm
