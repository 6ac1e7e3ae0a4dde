// Contacts of a surface with itself. Same reach, same rule as between two bodies (narrow_phase.h): a contact is a local minimum of the
// distance, seen from outside. What differs is said in self_contact.cpp.
#pragma once
#include <span>

#include "core/memory.h"
#include "surfel/contact_set.h"
#include "surfel/self_rest.h"
#include "surfel/views.h"

namespace dfm {

// Appends the contacts of one body, sorted by (kind, feature a, feature b); keys are unique within the sub-step. slot_a == slot_b, and the nodes of both
// sides are the body's. `distance` is the true one plus what the pair may be nearer than d_c at rest.
//   lent  scratch that the caller keeps
void find_self_contacts(const BodyView &body, const SelfRest &rest, std::span<const SelfPair> vertex_face, std::span<const SelfPair> edge_edge,
                        double h, double offset, Array<uint8_t> &lent, Array<ContactPoint> &out);

}  // namespace dfm
