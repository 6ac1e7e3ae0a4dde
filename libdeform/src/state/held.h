// Held points: which motions carry them. A point has at most one.
#pragma once
#include <cstdint>
#include <span>

#include "state/body.h"

namespace dfm {

// Takes the points out of the motions that carry them; a motion without points goes. All or nothing.
void drop_motions(Body &b, std::span<const uint32_t> points);

}  // namespace dfm
