// The state that a body begins in where that is not its rest state: scrambled, flattened or inside out.
#pragma once
#include "scene/defs.h"
#include "scene/select.h"

namespace dfm::scene {

// World positions of the body's points, [npoint,3]: a change of the rest positions about the center of
// their box, then the pose.
std::vector<double> start_positions(const Start &start, const BodyMesh &mesh, const dfm_pose &pose);

}  // namespace dfm::scene
