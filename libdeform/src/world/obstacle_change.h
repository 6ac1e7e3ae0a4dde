// What a host changes of an obstacle between two steps, beside its place: belt, filter, material.
#pragma once
#include "math/vec3.h"
#include "state/material.h"
#include "state/obstacle.h"

namespace dfm {

void set_belt(Obstacle &o, Vec3 velocity);
void set_filter(Obstacle &o, uint32_t category, uint32_t collides_with);
// material: null for none.
void set_material(Obstacle &o, const Material *material);
// After a restore: the defs that a host can ask for have the filter and the material that hold.
void renew_defs(Obstacle &o) noexcept;

}  // namespace dfm
