// Held points and the motions that carry them. A point has at most one motion.
#pragma once
#include <cstdint>
#include <span>

#include "state/body.h"

namespace dfm {

// Removes the points from the motions that carry them; a motion without points is removed. All or nothing.
void drop_motions(Body &b, std::span<const uint32_t> points);

}  // namespace dfm
