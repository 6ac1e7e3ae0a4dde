// Which surfaces are through each other where no step has put them: after a body or an obstacle is made, a
// state is set, a pose or a snapshot is put in place. Looked for once each time, not in every step;
// doc/concepts/overlaps.md.
#pragma once
#include "state/overlaps.h"

namespace dfm {

struct World;

// At the end of prepare(): the look that is due, with its warnings. What is through deeply leaves contact.
void settle_overlaps(World &w);
// Before a step: pairs that have come apart take part in contact again.
void release_overlaps(World &w);
// In prepare(), once the filter is made anew.
void keep_overlaps_aside(World &w);

}  // namespace dfm
