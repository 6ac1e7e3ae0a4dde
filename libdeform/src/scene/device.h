// "device" of a body: the model that the processor computes, or the one of that name on a graphics card.
#pragma once
#include "scene/load.h"
#include "scene/node.h"

namespace dfm::scene {

// Writes the models that bodies with "gpu" or "auto" have into the tree, with the device, and returns
// [{"name", "device", "model", "why"}] of them. Throws Error where "gpu" asks for what no card does here.
json choose_devices(dfm_context *context, const Definition &def, MeshFiles &files, json &tree);

// Whether a card moves the body by this model with its defaults without the loss of an effect. True where a
// card refuses the body, too: choose_devices says why.
bool whole_on_card(dfm_context *context, const Definition &def, const Body &body, const dfm_type &own);

}  // namespace dfm::scene
