// "device" of a body: the model that the processor computes, or the one of that name on a graphics card.
#pragma once
#include "scene/defs.h"
#include "scene/node.h"

namespace dfm::scene {

// Writes the models that bodies with "gpu" or "auto" have into the tree, with the device, and returns
// [{"name", "device", "model", "why"}] of them. Throws Error where "gpu" asks for what no card does here.
json choose_devices(dfm_context *context, const Definition &def, const Types &types, json &tree);

}  // namespace dfm::scene
