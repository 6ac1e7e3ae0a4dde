// Contacts of a sub-step from the pairs that broad/ lists: closest points at the start of the sub-step, made
// where they are nearer than
//     reach = 2 d_c + 2 h |relative velocity of the features|,
// so that whatever may touch within the sub-step is a constraint in its solve.
//
// One rule keeps ghosts out: a contact is a local minimum of the distance of the two surfaces, seen from
// outside. A point over a face has the face's normal; over an edge or a corner it counts only if no triangle
// beside it is nearer, and then once, not once per triangle. Two edges count only where both are convex and
// face each other. Beside a concave edge the second face's plane is a contact too if it can be reached. Edges
// that bore each other in the last sub-step count on, convex or not. All decisions use this and the geometry
// of the sub-step alone: more candidates never change the result.
#pragma once
#include <cstdint>
#include <span>

#include "contact/contact_set.h"
#include "core/memory.h"
#include "geometry/views.h"

namespace dfm {

// candidates: in the order of BroadPhase::candidates(). out is cleared; contacts come sorted by (body a, body
// before obstacle, body or obstacle b, kind, type_a, feature a, feature b), keys are unique. Does not
// allocate once out's capacity has settled.
//   h          s
//   offset     m, rest distance d_c
//   crossings  ascending: what edges bore in the last sub-step
//   lent       scratch that the caller keeps
// Numbers that are not finite make no contact.
void find_contacts(std::span<const BodyView> bodies, std::span<const ObstacleView> obstacles,
                   const Array<Candidate> &candidates, double h, double offset,
                   std::span<const Crossing> crossings, Array<uint8_t> &lent, Array<ContactPoint> &out);

}  // namespace dfm
