// The planner of a scene that names an accuracy or a budget: derives properties and contacts of each body
// from the definition and its meshes, lets accuracy.h choose, and returns the corresponding scene keys.
#pragma once
#include "scene/planner/accuracy.h"
#include "scene/load.h"
#include "scene/node.h"

namespace dfm::scene {

// The measured costs: of the file that the environment's DEFORM_COSTS names, else those that the library
// ships. Throws Error (which file, where, what was expected).
Measured read_costs();

// What the planner derives of each body.
std::vector<BodyRegime> regimes(dfm_context *context, const Definition &def, MeshFiles &files,
                                const Measured &measured);

// Chooses what the scene leaves open (model of a body, integrator, step, contact tolerance), writes it into
// the tree and returns the value of /accuracy/chosen or /budget/chosen. Keys that the scene names are kept.
json plan_scene(dfm_context *context, const Definition &def, MeshFiles &files, json &tree);

}  // namespace dfm::scene
