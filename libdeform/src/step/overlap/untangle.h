// Puts things that are through each other apart before a step is taken: bodies are moved as they are, without
// turning or bending them, so that no elastic energy and no velocity comes of it; doc/concepts/overlaps.md,
// doc/decisions/detection_and_guard.md.
#pragma once
#include <vector>

#include "step/overlap/overlap.h"

namespace dfm {

// Moves bodies until nothing of `found` overlaps any more, or not at all where it finds no way: those keep
// their places. Marks in `found` what is apart now.
void untangle(World &w, std::vector<Overlap> &found);

}  // namespace dfm
