// What a step does with tools: their poses at its end before the sub-steps, and the force on the hand after
// them.
#pragma once

namespace dfm {

struct Body;
struct Obstacle;
struct World;

void check_tool_ways(const World &w, double dt);  // throws Error where one would move too fast
// Is the obstacle a part with which a tool cuts this body? The two do not touch (doc/decisions/cutting.md).
bool passes_through(const World &w, const Body &b, const Obstacle &o);
void begin_tools(World &w, double dt);
// Takes back the work of hands in a step that ends early: the next one has the rest of their motion.
void take_back_work(World &w, double start);
void end_tools(World &w, double dt);

}  // namespace dfm
