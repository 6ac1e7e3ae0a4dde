// The part of a voxel obstacle that a body must never reach. The grid rounds off the shape by up to
// half a cell, so a body that lies on it may cut the triangles it was made from; half a cell further
// in, nothing may.
#pragma once
#include <vector>

#include "deform/obstacle.h"

namespace cli {

// Edge of the cubes by which def.cells fill the box of its points, m.
double voxel_cell(const dfm_obstacle_def &def);
// The points of def, each moved in so far that all planes of the triangles around it move by half a cell; at
// a spike by less, a cell's way in all. [npoint,3]
std::vector<double> voxel_core(const dfm_obstacle_def &def);

}  // namespace cli
