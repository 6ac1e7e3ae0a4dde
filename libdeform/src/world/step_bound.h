// The bound of the step: the longest sub-step at which no mode of any body grows (doc/concepts/step.md).
#pragma once

namespace dfm {

struct World;

bool bound_due(const World &w);  // does the next sub-step ask for it?
void update_bound(World &w);     // stable, worst_body, worst_point, inverted

}  // namespace dfm
