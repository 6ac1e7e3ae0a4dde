// What overlaps the sensors of a world (deform/sensor.h).
#pragma once
#include "state/world.h"

namespace dfm {

// Looks at all sensors as things stand now. tell: what has come or gone becomes events.
void look_at_sensors(World &w, bool tell);
// Ends what a thing takes part in: it goes, or is no sensor any more.
void leave_sensors(World &w, uint64_t id);

}  // namespace dfm
