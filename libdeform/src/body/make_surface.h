// Builds a body's surface from its triangles, and updates positions and velocities of its surfels from the
// phyxels.
#pragma once
#include <cstdint>
#include <functional>

#include "body/coupling.h"
#include "core/memory.h"
#include "geometry/surface.h"
#include "math/vec3.h"

namespace dfm {

// Identity coupling: the surfels are the points that the triangles use, in ascending point order.
//   rest           [npoint,3] m
//   boundary_tris  [ntri,3] point numbers, counter-clockwise seen from outside
// Open and non-manifold edges are kept: an edge's second triangle may be missing, and beyond two triangles
// the lowest ones count as its sides. x and v are sized and set to the rest shape and zero. Throws
// std::bad_alloc.
void make_surface(const Memory &memory, uint32_t npoint, const double *rest, const uint32_t *boundary_tris,
                  uint32_t ntri, Surface &out);

// Longest edge of the surface of a filled body, over the longest of its cells: contact with a plane acts at
// the points of the surface, and a body that rests on few of its cells crushes them
// (doc/decisions/meshes_and_labels.md).
constexpr double kLongestEdge = 2.5;

// Couples `surface`, built on its own points (all of them used, so that surfel s is point s), to phyxels. The
// next gather computes x as N times the phyxels.
void wear_coupling(Coupling &&coupling, Surface &surface);

// x_s = N x_p and v_s = N v_p. x and v are [npoint,4], aligned to 32 bytes; v null: x alone. Terms of a row
// are added in its order, so that rows may be cut among threads: gather_rows does surfels [begin,end) of a
// coupled surface.
void gather_surface(Surface &surface, const double *x, const double *v);
// The way by which each surfel of coincident faces is set back, in units of `back`.
// Between two bodies: of length one, in the direction that goes most steeply into the material, seen from
// that face around it where it does so least; shorter only where the normals hardly lie in one half-space.
// At a slit: the shortest w with n.w = -1 for each face, in the least-squares sense. At the tip of a slit
// both sides ask for the opposite of each other, and neither counts.
// x: [nsurfel,4]; may change in `use`.
void ways_back(Surface &surface, const double *x, const std::function<void(uint32_t surfel, Vec3 way)> &use);
void gather_rows(Surface &surface, const double *x, const double *v, uint32_t begin, uint32_t end);

}  // namespace dfm
