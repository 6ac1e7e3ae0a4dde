// Things that overlap the sensors of a world (deform/sensor.h).
#pragma once
#include "state/world.h"

namespace dfm {

// Updates all sensors at the present positions. tell: add an event for each change.
void update_sensors(World &w, bool report);
// Ends all overlaps of a thing that is removed, or is no longer a sensor.
void end_sensor_overlaps(World &w, uint64_t id);

}  // namespace dfm
