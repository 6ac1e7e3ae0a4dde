// Things that overlap the sensors of a world (deform/sensor.h).
#pragma once
#include "state/world.h"

namespace dfm {

// Updates all sensors at the present positions. tell: add an event for each change.
void look_at_sensors(World &w, bool tell);
// Ends all overlaps of a thing that is removed, or is no longer a sensor.
void leave_sensors(World &w, uint64_t id);

}  // namespace dfm
