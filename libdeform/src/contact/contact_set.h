// Contacts of one sub-step as a structure of arrays: found by narrow/, solved by contact/ and friction/, kept
// by step/, reported by world/.
//
//        a (surfel, edge or triangle of body a)
//        |  ^ normal (from b to a)
//   -----+-----  b (triangle or edge of body b, or an obstacle)
//
// Relative velocity u = sum_k weight[k] v[node[k]] - v_obstacle; the weights of side a sum to +1, those of
// side b to -1 (or there are none).
//
// Nodes are world-wide surfel numbers: surfel s of the body in slot k is node first_node[k] + s.
#pragma once
#include <compare>
#include <cstdint>

#include "math/vec3.h"

namespace dfm {

enum ContactKind : uint8_t { kVertexFace = 0, kEdgeEdge = 1, kPrimitive = 2 };

// One contact's geometry, as narrow/ emits it. Plain.
struct ContactPoint {
  // persistent: (kind, a's feature, b's body or obstacle, b's patch); unique within a sub-step where more = 0
  uint64_t key;
  uint32_t slot_a, slot_b;  // body slots in the world; slot_b = obstacle slot if obstacle
  // surfel, edge or triangle number within its body; primitive: obstacle feature (face, edge, corner)
  uint32_t feature_a, feature_b;
  uint8_t kind;
  uint8_t obstacle : 1;
  // 0; else a further row of the contact with this key, which stands before it (step/guard_hits.cpp)
  uint8_t more : 7;
  uint8_t nnode;
  uint8_t type_a;  // what feature_a is: 0 surfel, 1 edge, 2 triangle
  // area: for an edge or triangle contact, the node that lent it, plus 1; else 0
  uint32_t area_node_plus_1;
  uint32_t node[4];
  double weight[4];
  double point[3];   // m, midway between the closest points
  double normal[3];  // unit, from b to a
  double distance;   // m, true distance, >= 0; negative: depth below b's surface, for recovery
  double area;       // m2
  // m, >= 0: how far below the rest distance a load may press this contact (doc/decisions/contact_problem.md)
  double indentation;
  double velocity[3];  // m/s of the obstacle where a's closest point is, belt included; 0 for bodies
};

// Two edges that touched each other at the end of the last sub-step; b: of a body or of a mesh
// that has no dofs.
struct Crossing {
  uint64_t id_a, id_b;
  uint32_t edge_a, edge_b;
  auto operator<=>(const Crossing &) const = default;
};

inline uint8_t type_b(const ContactPoint &c) { return c.kind == kEdgeEdge ? 1 : 2; }

// A number of its side b: of a body's slot, or, with the top bit, of an obstacle's.
inline uint32_t side_b(const ContactPoint &c) { return c.slot_b | (c.obstacle ? 0x80000000u : 0u); }

// A contact's frame [9], normal and tangents: the vector of these components, and the components of a vector.
inline Vec3 from_frame(const double *f, Vec3 v) {
  return v.x * load3(f) + v.y * load3(f + 3) + v.z * load3(f + 6);
}
inline Vec3 in_frame(const double *f, Vec3 v) {
  return {dot(load3(f), v), dot(load3(f + 3), v), dot(load3(f + 6), v)};
}

}  // namespace dfm
