// The rest shape of a surface, to decide whether two near parts of it have come near or have always been
// near.
#pragma once
#include <algorithm>

#include "core/memory.h"
#include "math/vec3.h"

namespace dfm {

// Contact across the open faces (mesh/cut_mesh.h) of a cut body, where the surface coincides with itself at
// rest. All lists are empty if no face is open.
struct OpenedSurface {
  Array<uint32_t> origin;  // [nsurfel] point of the whole body: copies of a point have one number
  Array<uint32_t> twin;    // [ntri] triangle on the other side of the open face, or kNone
  // [ntri] the side of a slit that a triangle belongs to, or kNone: triangles of open faces that hang
  // together over their edges, but not over the edge at the tip of a slit, where a face meets its other side
  Array<uint32_t> side;
  // [nsurfel] points of the body that a surfel has an edge with, ascending, from begin[s] to begin[s+1]; and
  // its own point
  Array<uint32_t> begin, near, point;

  bool any() const { return !origin.empty(); }
  // Whether two surfels are connected by at most two edges of cells.
  bool joined(uint32_t a, uint32_t b) const {
    if (a == b) return true;
    const auto first = near.begin() + begin[a], last = near.begin() + begin[a + 1];
    if (std::binary_search(first, last, point[b])) return true;
    return std::any_of(near.begin() + begin[b], near.begin() + begin[b + 1],
                       [&](uint32_t p) { return std::binary_search(first, last, p); });
  }
};

struct SelfRest {
  Array<double> x;  // [nsurfel,4] m, N times the phyxels at rest, in the mesh's frame
  OpenedSurface opened;
  Array<double> way;  // [nsurfel,4] by which a surfel is set back in units of Surface::back; empty: none is
  // m: parts that are nearer than this through the material are the two sides of one layer of cells or two
  double thin = 0;
  Vec3 at(uint32_t surfel) const { return load3(&x[4 * size_t{surfel}]); }
  Vec3 at(uint32_t surfel, double back) const { return at(surfel) + back * load3(&way[4 * size_t{surfel}]); }
};

// of d_c: parts that are nearer at rest coincide and have no side
inline constexpr double kClosedAtRest = 1e-2;

// Two features of one surface: a surfel and a triangle without it, or two edges without a common end, the
// lower one first.
struct SelfPair { uint32_t a, b; };

}  // namespace dfm
