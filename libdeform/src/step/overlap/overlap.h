// Finds surfaces that cross each other other than by a step: after a body or obstacle is created, or a state,
// pose or snapshot is set. Searched once each time, not in every step; doc/concepts/overlaps.md.
#pragma once
#include <cstdint>
#include <vector>

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
// Puts things that are through each other apart before a step is taken: moves bodies as they are, without
// turning or bending them, so that no elastic energy and no velocity comes of it, until nothing of `found`
// overlaps any more, or not at all where it finds no way (doc/decisions/detection_and_guard.md). Marks in
// `found` what is apart now.
void untangle(World &w, std::vector<Overlap> &found);
// In prepare(), after the filter has been rebuilt.
void keep_suspended(World &w);

}  // namespace dfm
