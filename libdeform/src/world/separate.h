// Parts of a body that hang together no more become bodies of their own (doc/concepts/cutting.md).
#pragma once
#include "world/cut.h"

namespace dfm {

// Each part but the heaviest becomes a body; those of fewer cells than the rule's `least` stay with the
// heaviest, or go. Adds to what `out` tells of the cut before. Throws Error, and then nothing has changed.
void separate(Body &b, const SeparateRule &rule, CutReport &out);
// As the body's own rule says, if it does. Parts that find no memory stay in the body, and its rule keeps
// that they wait: the cut before has been made and told, and is not made again.
void separate_if_asked(Body &b, CutReport &out);
void separate_if_asked(Body &b);
// Tries again where parts wait.
void separate_what_waits(World &w);

// A piece without a shape, under this id and name, in World::undone: the one that had the id before a restore
// took it back, or a new one. `of` made it, or is the body that the host made.
Body &place_for_piece(World &w, const Body &of, uint64_t id, const std::string &name);
// Where the body that the host made is destroyed, its pieces become bodies like any other.
void orphan_pieces(World &w, const Body &whole);

}  // namespace dfm
