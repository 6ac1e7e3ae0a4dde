// What a body carries over into its shape after a cut, other than its points.
#pragma once
#include <optional>

#include "world/body_shape.h"

namespace dfm {

// `before`: the previous shape of the body, or of the body that it came from; the mesh maps present to
// previous numbers. Lasting loads, springs and motions of points. A load on a split point is divided among
// its copies in proportion to their masses; a load on a removed point is removed.
void carry_loads(const Former &before, const CutMesh &mesh, Body &b);
// None: the model needs all of its cells.
std::optional<dfm_topology> topology_of(const ModelInstance &model);
// [nedge] previous numbers, kNone for new ones; edges are in lexicographic order.
std::vector<uint32_t> edges_before(const Array<uint32_t> &before, const CutMesh &mesh,
                                   const Array<uint32_t> &now);
// The state of the model: slots by point, cell, edge and instance; new edges start in the initial state.
void carry_state(const Former &before, const CutMesh &mesh, const std::vector<uint32_t> &edge, Body &b);
// [nsurfel] previous numbers; kNone for new ones, and for copies but the first.
std::vector<uint32_t> surfels_before(const Body &before, const CutMesh &mesh, const Surface &now);
// Impulses of surfels; new ones have none.
void carry_surfels(const Array<double> &from, const std::vector<uint32_t> &surfel, Array<double> &to);

}  // namespace dfm
