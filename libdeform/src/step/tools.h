// What a step asks of tools: before its sub-steps where they are to be at its end, and after them what the
// hand gets.
#pragma once

namespace dfm {

struct World;

void check_tool_ways(const World &w, double dt);  // throws Error where one would move too fast
void begin_tools(World &w, double dt);
void end_tools(World &w, double dt);

}  // namespace dfm
