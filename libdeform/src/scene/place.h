// A body put on an obstacle, as "place" asks.
#pragma once
#include "scene/load.h"

namespace dfm::scene {

// At about the rest distance of contacts above the obstacle of its scene that it lies on, so that it neither
// overlaps nor falls. Throws where that is a wall, or does not lie below or above the body.
dfm_pose put_on(dfm_context *context, const Definition &def, MeshFiles &files, const Body &body,
                const BodyMesh &mesh);

}  // namespace dfm::scene
