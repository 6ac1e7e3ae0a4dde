// The surface of one body: surfels, triangles, edges, patches, and the coupling of surfels to phyxels. Filled
// once per topology by make_surface, and by wear_coupling for a separate surface; x and v are computed in
// every sub-step from the phyxels (N x_p).
#pragma once
#include <cstdint>
#include <memory>

#include "core/memory.h"
#include "math/vec3.h"

namespace dfm {

class BoxTree;

inline constexpr uint32_t kNone = UINT32_MAX;
inline constexpr uint32_t kFeatureKinds = 4;  // surfels, edges, triangles, patches

// Names below these were given while the body was part of another one.
struct NamedBy {
  uint64_t id;  // of that body
  uint32_t below[kFeatureKinds];
  bool operator==(const NamedBy &) const = default;
};

inline constexpr uint8_t kOfSlit = 8;  // of Surface::coincident_tip

struct Surface {
  uint32_t nsurfel = 0, ntri = 0, nedge = 0;
  Array<uint32_t> tri;   // [ntri,3] surfels, counter-clockwise seen from outside
  Array<uint32_t> edge;  // [nedge,2] surfels i < j, lexicographic
  // [nedge,2] the triangles on both sides, kNone where open; first has the edge as i -> j
  Array<uint32_t> edge_tri;
  Array<uint32_t> tri_edge;  // [ntri,3] edge k joins corners k and k+1
  // [ntri] bits 0-2: owns corner k; bits 3-5: owns edge k. Each surfel and edge has one owner
  Array<uint32_t> tri_owns;
  // [ntri] features that share an edge within 60 degrees of normal (rest shape) are one patch
  Array<uint32_t> patch;
  // For a body that has been cut: names of surfels, edges and triangles in contact keys, so that remaining
  // features keep theirs; patch contains such names itself. Empty: names are the numbers.
  Array<uint32_t> name[3];
  // For a piece of a body, the oldest first: its contacts keep the keys that they had in the whole body.
  Array<NamedBy> named;
  // Id under which the name of a feature was given; `own` is the body's.
  uint64_t namer(uint32_t kind, uint32_t feature, uint64_t own) const {
    for (const NamedBy &n : named)
      if (feature < n.below[kind]) return n.id;
    return own;
  }
  // Id of the body, made by the host, that this one is or comes from; own: the id of this one.
  uint64_t whole(uint64_t own) const { return named.empty() ? own : named.front().id; }
  Array<uint32_t> fan_begin, fan;  // [nsurfel+1], triangles around each surfel, ascending
  double median_edge = 0;          // m, rest
  // Quadratic patches over the triangles (geometry/bulge.h): [ntri] a fourth surfel, kNone: a flat one;
  // [ntri,9]; at least 1, a bound of the sum of |weight| of a point of a patch. Empty: all are flat.
  Array<uint32_t> bulge_from;
  Array<double> bulge;
  double bulge_sum = 1;

  // Coupling x_s = N x_p. Identity: row, col, weight and rest are empty and point[s] is surfel s's phyxel.
  // Else N in CSR, columns ascending, and point is empty.
  Array<uint32_t> point, row, col;
  Array<double> weight;
  // largest sum of |weight| of a row: how much faster than its phyxels a surfel may be
  double weight_sum = 1;
  // [nsurfel,3] m, as given; where N does not reproduce linear fields this is not N times the phyxels at rest
  Array<double> rest;
  bool identity() const { return row.empty(); }
  // Calls f(phyxel, weight) for all phyxels of surfel s.
  template <class F>
  void each_phyxel(uint32_t s, F &&f) const {
    if (identity()) return f(point[s], 1.0);
    for (uint32_t j = row[s]; j < row[s + 1]; ++j) f(col[j], weight[j]);
  }

  // At surfel s, of a column [nphyxel,4].
  Vec3 sum(uint32_t s, const double *column) const {
    if (identity()) return load3(column + size_t{4} * point[s]);
    Vec3 out;
    each_phyxel(s, [&](uint32_t p, double w) { out += w * load3(column + size_t{4} * p); });
    return out;
  }

  // Twice the area of a triangle whose surfels are at these places, along its normal.
  template <class At>
  Vec3 area2(size_t t, At &&at) const {
    const Vec3 a = at(tri[3 * t]);
    return cross(at(tri[3 * t + 1]) - a, at(tri[3 * t + 2]) - a);
  }

  // Triangles that coincided with others when a cut opened the face between them, and their surfels; `slit`:
  // some coincide with others of this surface. x is set back there by half of the rest distance of contacts:
  // copies of a point in one place would touch along the normals of all faces around them, which no motion
  // satisfies (doc/decisions/cutting.md).
  Array<uint32_t> coincident, coincident_surfel;
  // [coincident] bits 0-2: corner k is the tip of a slit: the face on the other side has the same surfel; bit
  // 3: it is of a slit
  Array<uint8_t> coincident_tip;
  bool slit = false;
  double back = 0;         // m
  Array<double> place;     // [nsurfel,4] m, x before it is set back; empty without such triangles
  Array<uint32_t> origin;  // [nsurfel] point of the body as it was made; empty without such triangles
  // around a surfel of coincident_surfel, from begin[i] to begin[i+1]: places in `coincident`, without those
  // that have their tip there
  Array<uint32_t> coincident_begin, coincident_around;
  Array<double> coincident_normal;  // scratch, [coincident,3]

  // Over the triangles at rest, where the surface was made in advance: trees over the present triangles take
  // its topology instead of a search for one. Null: there is none.
  std::shared_ptr<const BoxTree> tree;

  // State, [nsurfel,4] (fourth component zero), m and m/s.
  Array<double> x, v;
};

}  // namespace dfm
