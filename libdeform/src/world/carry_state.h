// What a body takes along into the shape that a cut leaves it, beside its points.
#pragma once
#include <optional>

#include "world/body_shape.h"

namespace dfm {

// `before`: what the body had, or the body that it comes off; numbers before by numbers now are the mesh's.
// Lasting loads, springs and motions of points. A load on a point that is split is shared by its copies as
// their masses are; on a point that is gone it goes.
void carry_loads(const Former &before, const CutMesh &mesh, Body &b);
// None: the model needs the whole of its cells.
std::optional<dfm_topology> topology_of(const ModelInstance &model);
// The state of the model: slots by point, cell, edge and instance; edges that are new begin as at first.
void carry_state(const Former &before, const CutMesh &mesh, Body &b);
// Impulses of surfels; a copy has none.
void carry_surfels(const Body &before, const CutMesh &mesh, BodyShape &out);

}  // namespace dfm
