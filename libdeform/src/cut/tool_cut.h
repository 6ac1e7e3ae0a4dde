// Tools that cut what they pass through, at the end of each step (doc/concepts/cutting.md).
#pragma once
#include <cstdint>
#include <span>

namespace dfm {

struct Body;
struct Tool;
struct World;

// how: DFM_CUT_*; most: cells or faces of a body in a step, 0: no limit; no bodies: it cuts nothing. Throws
// Error, and then nothing has changed.
void set_cuts(Tool &tool, uint32_t how, uint32_t most, std::span<Body *const> bodies);
// Throws Error unless its shape can cut in this way.
void check_tool_cuts(const Tool &tool, uint32_t how);

// Before a step: remembers where the tools that cut are. After it: cuts what their parts have met on the way.
// The latter throws Error; bodies before the one that fails have been cut then.
void begin_cuts(World &w);
void cut_by_tools(World &w, double dt);

}  // namespace dfm
