#pragma once

namespace dfm {

struct Body;
struct World;

// Logs a warning if the weight of a new body presses it flat. The usual causes are a mesh in millimeters and
// a material that was forgotten.
void warn_of_own_weight(const World &w, Body &b);

}  // namespace dfm
