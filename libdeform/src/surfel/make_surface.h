// Builds a body's surface from its boundary triangles, and renews positions and velocities of its surfels from the phyxels.
#pragma once
#include <cstdint>

#include "core/memory.h"
#include "surfel/surface.h"

namespace dfm {

// Identity coupling: the surfels are the points that the triangles use, in ascending point order.
//   rest           [npoint,3] m
//   boundary_tris  [ntri,3] point numbers, counter-clockwise seen from outside
// Open and non-manifold edges are kept: an edge's second triangle may be missing, and beyond two triangles the lowest ones count as its
// sides. x and v are sized and set to the rest shape and zero. Throws std::bad_alloc.
void make_surface(const Memory &memory, uint32_t npoint, const double *rest, const uint32_t *boundary_tris, uint32_t ntri, Surface &out);

// x_s = N x_p and v_s = N v_p. x and v hold a phyxel in every `stride` doubles (>= 3). Terms of a row are added in its order.
void gather_surface(Surface &surface, const double *x, const double *v, uint32_t stride);

}  // namespace dfm
