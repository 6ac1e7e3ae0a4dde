// Shared by the files of narrow/.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "contact/contact_set.h"
#include "contact/reach.h"
#include "geometry/area.h"
#include "geometry/convex.h"
#include "geometry/obstacle_shape.h"
#include "geometry/views.h"
#include "geometry/voxel_grid.h"
#include "narrow/list_memory.h"
#include "narrow/parts.h"

namespace dfm::narrow {

using Run = std::span<const Candidate>;

// Cosines and sines of directions, dimensionless.
constexpr double kFlat = 1e-3;  // slack of the cones of normals against the edges of a box
// 2 degrees: slack of an edge's cone of normals, so that contacts do not flicker at its border
constexpr double kCone = 0.035;
// sine between two edges below which vertex-face contacts replace their contact
constexpr double kParallel = 1e-3;
// share of an edge by which it may count as longer for what slides in over its ends
constexpr double kPast = 0.25;
// of the rest offset: what a face's inside is nearer to voxels than its corners by less is left
// to the corners
constexpr double kMinDip = 0.1;
// share of an edge next to its ends that is left to vertex-face contacts: no longer than the default d_c
constexpr double kEnd = 1e-3;

struct Pair {
  const BodyView &a;
  const BodyView *b;  // or
  const ObstacleShape *shape;
  double h, offset;
  double speed_b;                         // m/s, bound over body b's surfels
  std::span<const Crossing> crossings{};  // of this pair, in their order
  bool parts = false;                     // of one body, made by a cut (narrow/parts.h)
  KnownRun known{};                       // of the candidates

  Vec3 xa(uint32_t s) const { return load3(&a.surface->x[4 * size_t{s}]); }
  Vec3 va(uint32_t s) const { return load3(&a.surface->v[4 * size_t{s}]); }
  Vec3 xb(uint32_t s) const { return load3(&b->surface->x[4 * size_t{s}]); }
  Vec3 vb(uint32_t s) const { return load3(&b->surface->v[4 * size_t{s}]); }
  // Whether edge a touched any edge of b, or this one, at the end of the last sub-step.
  bool bears(uint32_t edge_a) const {
    const auto at = std::lower_bound(crossings.begin(), crossings.end(), edge_a,
                                     [](const Crossing &c, uint32_t edge) { return c.edge_a < edge; });
    return at != crossings.end() && at->edge_a == edge_a;
  }
  bool bears(uint32_t edge_a, uint32_t edge_b) const {
    const uint64_t id_b = b ? b->id : shape->view().id;
    return std::binary_search(crossings.begin(), crossings.end(), Crossing{a.id, id_b, edge_a, edge_b});
  }
};

// Strong enough that a collision of two keys is as unlikely as a memory error.
inline uint64_t mix(uint64_t hash, uint64_t value) {
  hash = (hash ^ value) * 0xff51afd7ed558ccdull;
  hash ^= hash >> 32;
  hash *= 0xc4ceb9fe1a85ec53ull;
  return hash ^ hash >> 29;
}
// The patch that a face or an edge of b belongs to. kind: of the contact.
inline uint32_t patch_of(const Surface &b, uint8_t kind, uint32_t feature) {
  if (kind != kEdgeEdge) return b.patch[feature];
  const uint32_t *const sides = &b.edge_tri[2 * size_t{feature}];
  return b.patch[sides[0] != kNone ? sides[0] : sides[1]];
}
// a, b: the surfaces of the sides; b null where patches have no names. ordinal: distinguishes contacts of one
// feature with one patch, in the order of b's features.
inline uint64_t contact_key(const ContactPoint &c, const Surface &a, uint64_t id_a, const Surface *b,
                            uint64_t id_b, uint32_t patch, uint32_t ordinal) {
  const Array<uint32_t> &names = a.name[c.type_a];
  uint32_t feature = c.feature_a;
  if (!names.empty()) {
    feature = names[feature];
    id_a = a.namer(c.type_a, feature, id_a);
  }
  if (b && !b->named.empty()) id_b = b->namer(3, patch, id_b);
  const uint64_t head =
      uint64_t{c.kind} | uint64_t{c.obstacle} << 8 | uint64_t{c.type_a} << 16 | uint64_t{ordinal} << 32;
  uint64_t hash = mix(0x9e3779b97f4a7c15ull, head);
  hash = mix(hash, id_a);
  hash = mix(hash, id_b);
  return mix(hash, uint64_t{feature} << 32 | patch);
}

// Blank contact of a pair; the caller fills geometry, nodes and weights.
inline ContactPoint blank(const Pair &pair, uint8_t kind, uint8_t type_a, uint32_t feature_a,
                          uint32_t feature_b) {
  ContactPoint c{};
  c.kind = kind;
  c.type_a = type_a;
  c.slot_a = pair.a.slot;
  c.slot_b = pair.b ? pair.b->slot : pair.shape->view().slot;
  c.obstacle = pair.b ? 0 : 1;
  c.feature_a = feature_a;
  c.feature_b = feature_b;
  return c;
}
inline void add_node(ContactPoint &c, uint32_t node, double weight) {
  if (weight == 0) return;
  c.node[c.nnode] = node;
  c.weight[c.nnode++] = weight;
}
inline void place(ContactPoint &c, Vec3 on_a, Vec3 on_b, Vec3 normal, double distance) {
  store3(c.point, 0.5 * (on_a + on_b));
  store3(c.normal, normal);
  c.distance = distance;
}

// Lets a contact between two such parts rest where they touched as one: `distance` of what rests nearer than
// d_c grows by the difference. False: it is out of reach then.
inline bool rests(const Pair &pair, double reach, ContactPoint &c) {
  if (!pair.parts) return true;
  c.distance += pair.offset - rest_of_parts(*pair.a.surface, *pair.b->surface, c.kind, c.feature_a,
                                            c.feature_b, load3(c.normal), pair.offset);
  return c.distance < reach;
}

struct AreaOwner {
  const BodyView &body;
  Vec3 out;  // of its surface, at the contact
};
// An edge or triangle contact takes the share of the area of the nearest of its nodes that has not lent its
// own (doc/concepts/detection.md). area_node_plus_1: that node plus 1. owner(k): AreaOwner of node k;
// lent: [nodes] from `first` on
template <class Owner>
void take_area(ContactPoint &c, double share, const Owner &owner, uint32_t first, Array<uint8_t> &lent) {
  double nearest = 0;
  for (int k = 0; k < c.nnode; ++k) {
    const auto [body, out] = owner(k);
    const uint32_t surfel = c.node[k] - body.first_node;
    const double d2 = norm2(load3(&body.surface->x[4 * size_t{surfel}]) - load3(c.point));
    if (lent[c.node[k] - first] || (c.area_node_plus_1 && !(d2 < nearest))) continue;
    nearest = d2;
    c.area_node_plus_1 = c.node[k] + 1;
    c.area = share * facing_area(*body.surface, surfel, out);
  }
  if (c.area_node_plus_1) lent[c.area_node_plus_1 - 1 - first] = 1;
}

// Gives contacts of surfaces, from `begin` on, their keys: those of one feature of a with one patch of b are
// counted. The area that each has, a surfel's, is divided among those in which the surfel touches.
void name_contacts(const Pair &pair, size_t begin, Array<ContactPoint> &out);

// Each works on one run: all candidates of one pair and kind.
void vertex_face(const Pair &pair, Run run, Array<ContactPoint> &out);
void edge_edge(const Pair &pair, Run run, Array<ContactPoint> &out);
void surfel_obstacle(const Pair &pair, Run run, Array<ContactPoint> &out);
void edge_obstacle(const Pair &pair, Run run, Array<ContactPoint> &out);
void triangle_obstacle(const Pair &pair, Run run, Array<ContactPoint> &out);
// Finds whether a place inside the face x (in the frame of the grid) is lower than its corners by more than
// `dip`, and where and how low. Skips faces above `most`.
bool dips(const VoxelGrid &grid, const Vec3 x[3], double most, double dip, double weight[3],
          double &distance);
void voxel_triangle(const Pair &pair, Run run, Array<ContactPoint> &out);
// A contact on `q` of the body (nodes and weights already set), on `o` of the obstacle.
void finish(const Pair &pair, ContactPoint &c, Vec3 q, Vec3 o, Vec3 normal, double distance, uint32_t patch,
            Array<ContactPoint> &out);
// The reach of these surfels against the obstacle's surface at o.
double reach_of(const Pair &pair, std::span<const uint32_t> nodes, Vec3 o);
// A body against a mesh without dofs: pair.b is the mesh, and its nodes come after those of all bodies.
void mesh_obstacle(const Pair &pair, const ObstacleView &view, uint8_t kind, Run run,
                   Array<ContactPoint> &out);
// The faces beside an edge and their cone of normals: a unit direction that is orthogonal to the edge lies in
// it if it leans to neither face by more than `slack` (sine) and leaves the surface. Where the faces are
// nearly flat, the direction straight into the body leans to neither of them, too.
struct EdgeFaces {
  Vec3 along;  // unit, i to j
  // unit; inward lies in the face, orthogonal to the edge; both zero where there is no face
  Vec3 normal[2], inward[2];
  Vec3 outward() const { return normal[0] + normal[1]; }
  bool leans_out(Vec3 n, double slack) const {
    return dot(n, inward[0]) <= slack && dot(n, inward[1]) <= slack;
  }
  // Not into the body. At a rim, which has one face only, other bodies may come from the side, along the
  // face.
  bool is_outward(Vec3 n, double slack) const { return dot(n, outward()) > -slack; }
};
EdgeFaces edge_faces(const Surface &surface, uint32_t edge);
bool edge_becomes_convex(const Surface &surface, uint32_t edge, double h);
constexpr int kNowhere = -2, kBetween = -1;  // else the end: 0 or 1
int place_on_edge(double at, double slide);
// Whether the lines p0 + s u and q0 + t w cross on both edges, or come to within 2 h, beginning within reach.
// v: velocity of the crossing's point on the first relative to that on the second
bool slides_in(Vec3 p0, Vec3 u, Vec3 q0, Vec3 w, double s, double t, Vec3 v, double h, double reach);

}  // namespace dfm::narrow
