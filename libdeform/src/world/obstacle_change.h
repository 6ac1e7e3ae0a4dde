// Changes of an obstacle by the host between two steps, other than its pose: belt, filter, material.
#pragma once
#include "math/vec3.h"
#include "state/material.h"
#include "state/obstacle.h"

namespace dfm {

void set_belt(Obstacle &o, Vec3 velocity);
void set_filter(Obstacle &o, uint32_t category, uint32_t collides_with);
// material: null for none.
void set_material(Obstacle &o, const Material *material);
// After a restore: updates the defs that a host can query with the present filter and material.
void renew_defs(Obstacle &o) noexcept;

}  // namespace dfm
