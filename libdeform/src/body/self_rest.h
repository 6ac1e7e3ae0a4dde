// The rest shape of a surface, to decide whether two near parts of it have come near or have always been
// near.
#pragma once
#include <algorithm>

#include "core/memory.h"
#include "geometry/surface.h"
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
  // Two copies of one point, a > b, ascending by a. first: the lowest triangle around b that was joined to
  // one around a, or kNone.
  struct Copies { uint32_t a, b, first; };
  Array<Copies> copies;
  Array<uint32_t> copies_begin;  // [nsurfel+1] of `copies`, by a

  bool any() const { return !origin.empty(); }
  uint32_t copies_of(uint32_t i, uint32_t j) const {  // place in `copies`
    const uint32_t a = std::max(i, j), b = std::min(i, j);
    for (uint32_t k = copies_begin[a]; k < copies_begin[a + 1]; ++k)
      if (copies[k].b == b) return k;
    return kNone;
  }
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

// of d_c: how far setting back moves two features against each other, each by half of it at most. Copies of a
// point that have slid by less make one contact, and hold the features around them.
inline constexpr double kNearCopies = 3;
// of d_c: as much nearer than the material touches features may come while copies hold them
inline constexpr double kLeftToCopies = 0.5;
// m, distance at which features rest that have copies of one point among their corners.
//   back   what setting back has added to their distance, so that the material touches at it
//   apart  of the copies: beyond kNearCopies contact goes over to the rule of two bodies
inline double rest_beside(double back, double apart, double offset) {
  const double held = std::clamp(2 - apart / (kNearCopies * offset), 0.0, 1.0);
  return held * (std::min(offset, back) - kLeftToCopies * offset) + (1 - held) * offset;
}

// of d_c: parts that are nearer at rest coincide and have no side
inline constexpr double kClosedAtRest = 1e-2;

// Two features of one surface: a surfel and a triangle without it, or two edges without a common end, the
// lower one first.
struct SelfPair {
  uint32_t a, b;
  double apart;  // m, at the positions to which the list refers
};

// What a pair is at rest.
struct PairAtRest {
  double apart = 0;                     // m it rests at; of no use beside copies
  uint32_t copies[2] = {kNone, kNone};  // of one point, among its corners: places in OpenedSurface::copies
  int8_t side = 0;                      // 1: kept apart outside, -1: within, 0: where it is
  bool touches = true;                  // false: it makes no contact
  bool known = false;
  bool beside() const { return copies[0] != kNone; }
};

}  // namespace dfm
