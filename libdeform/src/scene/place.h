// A body put on an obstacle, as "place" asks.
#pragma once
#include <vector>

#include "deform/obstacle.h"

namespace dfm::scene {

// m, along `up` (unit), negative where it is down: how far points [n,3] move so that their convex hull
// touches the obstacle from above. It is found in a world of its own by the queries that any program has.
// Throws where the obstacle is a wall, or does not lie below or above the points.
double lift_onto(dfm_context *context, const dfm_obstacle_def &on, const std::vector<double> &points,
                 const double up[3]);

}  // namespace dfm::scene
