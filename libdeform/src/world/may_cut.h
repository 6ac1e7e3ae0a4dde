// Whether a body may be cut, and whether anything does.
#pragma once
#include <optional>

#include "deform/plugin_draft.h"

namespace dfm {

struct Body;
struct ModelInstance;

// None: the model needs all of its cells.
std::optional<dfm_topology> topology_of(const ModelInstance &model);
// Throws Error if the body cannot be cut while it has this model.
void check_may_cut(const Body &b, const ModelInstance &model);
// Whether a material of its cells has "tear".
bool may_tear(const Body &b);
bool cut_by_any(const Body &b);  // of its world's tools

}  // namespace dfm
