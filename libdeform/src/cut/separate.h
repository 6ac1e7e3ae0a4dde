// Parts of a body that are no longer connected become bodies of their own (doc/concepts/cutting.md).
#pragma once
#include "cut/cut.h"

namespace dfm {

// Each part but the heaviest becomes a body. Parts of fewer cells than the rule's `least` stay with the part
// that is nearest, or are removed. Adds to `out`, the report of the cut before. Throws Error, and then
// nothing has changed.
void separate(Body &b, const SeparateRule &rule, CutReport &out);
// Separates as the body's own rule says, if it has one. If memory runs out, the parts stay in the body, and
// the rule notes that they wait: the cut before has been made and reported, and is not made again.
void separate_if_requested(Body &b, CutReport &out);
void separate_if_requested(Body &b);
// Tries again for parts that wait.
void separate_what_waits(World &w);

// A piece without a shape, with this id and name, in World::rolled_back: the one of that body and name that a
// restore has undone, or a new one. `of` made it, or is the body that the host made. Another one that had the
// id gets one above kMaxIds.
Body &place_for_piece(World &w, const Body &of, uint64_t id, const std::string &name);

}  // namespace dfm
