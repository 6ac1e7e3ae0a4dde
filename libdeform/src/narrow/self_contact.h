// Contacts of a surface with itself. Same reach, same rule as between two bodies (narrow_phase.h): a contact
// is a local minimum of the distance, seen from outside. The differences are described in self_contact.cpp.
#pragma once
#include <functional>
#include <span>

#include "body/self_rest.h"
#include "contact/contact_set.h"
#include "core/memory.h"
#include "geometry/views.h"

namespace dfm {

// Whether a surfel belongs to a triangle that passes through another one at the start of the sub-step. Called
// only if a pair seems to have crossed.
using Tangled = std::function<bool(uint32_t surfel)>;

// Relative position of two copies of one point at the start of the sub-step.
struct CopiesNow {
  Vec3 normal;       // mean of the faces that were joined at them, from b to a
  double gap, slip;  // m, along it, across it
  double apart;      // m
  double speed;      // m/s, against each other
};

// The listed pairs of a body, and what detection keeps of them.
struct SelfPairs {
  std::span<const SelfPair> vertex_face, edge_edge;
  // by pair, of a body with open faces; but for `copies` filled where one comes near
  Array<PairAtRest> of_face, of_edges;
  Array<CopiesNow> copies;
  // [copies] m, by how much they may approach before features around them have to be tested
  // (doc/decisions/cutting.md)
  Array<double> slack;
  double within = 0;  // m, pairs whose `apart` is not less are out of reach
  uint64_t renewals = 0;
  double offset = 0;
  // Follows the surface in this sub-step. list: number of the present list.
  void follow(const Surface &surface, const SelfRest &rest, uint64_t list, double d_c);
};

// Appends the contacts of one body, sorted by (kind, feature a, feature b); keys are unique within the
// sub-step. slot_a == slot_b, and the nodes of both sides are the body's. `distance` is the true one plus
// what the pair may be nearer than d_c at rest.
//   tangled  where the guard sees to it that nothing passes, what is on the wrong side without being tangled
//   has come there another way, and stays; empty: it
//            is led back
//   lent     scratch that the caller keeps
void find_self_contacts(const BodyView &body, const SelfRest &rest, double h, double offset,
                        const Tangled &tangled, SelfPairs &pairs, Array<uint8_t> &lent,
                        Array<ContactPoint> &out);

// m, rest distance of two features of one surface: min(offset, half of their distance in the rest shape). 0
// if they coincide there: no contact.
double self_apart(const Surface &surface, const SelfRest &rest, ContactKind kind, uint32_t a, uint32_t b,
                  double offset);

}  // namespace dfm
