// Finds surfaces that cross each other other than by a step: after a body or obstacle is created, or a state,
// pose or snapshot is set. Searched once each time, not in every step; doc/concepts/overlaps.md.
#pragma once
#include <cstdint>

#include "state/overlaps.h"

namespace dfm {

struct Body;
struct World;

uint64_t made_id(const Body &b);  // id of the body that it is a piece of, or its own
// At the end of prepare(): the pending search, with its warnings. Deep overlaps are excluded from contact.
void resolve_overlaps(World &w);
// The next search covers a piece that a separation has made. How it lies in the other parts of its body is
// what contact has left, and no place that somebody has put it in, so contact with them stays on.
void place_piece(World &w, uint64_t id);
// Before a step: includes separated pairs in contact again.
void release_overlaps(World &w);
// In prepare(), after the filter has been rebuilt.
void keep_suspended(World &w);

}  // namespace dfm
