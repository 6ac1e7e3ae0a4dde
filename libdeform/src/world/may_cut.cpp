#include "world/may_cut.h"

#include <algorithm>
#include <cstddef>

#include "core/error.h"
#include "mesh/cells.h"
#include "plugin/tables.h"
#include "state/material.h"
#include "state/tool.h"
#include "state/world.h"

namespace dfm {
namespace {

constexpr size_t kTopologyHead = offsetof(dfm_topology, carry) + sizeof(void *);

}  // namespace

std::optional<dfm_topology> topology_of(const ModelInstance &model) {
  return copy_table<dfm_topology>(model.extension(DFM_EXT_TOPOLOGY), kTopologyHead, model.type->id,
                                  "dfm_topology");
}

void check_may_cut(const Body &b, const ModelInstance &model) {
  const char *const name = b.name.c_str();
  if (!b.cells.empty())
    fail(DFM_E_UNSUPPORTED,
         "body '%s' can be neither cut nor torn: its cells are %s; give it a mesh of first-order tetrahedra",
         name, cell_kind(b.cell_type).name);
  if (!b.surface.identity())
    fail(DFM_E_UNSUPPORTED,
         "body '%s' can be neither cut nor torn: it has its own surface; create it with the boundary of its "
         "cells as surface (in a scene: \"surface\": {\"from\": \"boundary\"}), which is then drawn and "
         "touches: steps as large as its %u cells in place of %u triangles",
         name, b.ncell(), b.surface.ntri);
  if (b.scaling.moved > 0)
    fail(DFM_E_UNSUPPORTED,
         "body '%s' can be neither cut nor torn: mass has been moved between its points; create it without "
         "mass_scaling",
         name);
  if (!topology_of(model))
    fail(DFM_E_UNSUPPORTED,
         "body '%s' can be neither cut nor torn: model '%s' needs all of its cells; take msm or "
         "corotational_fem",
         name, model.type->id);
}

bool may_tear(const Body &b) {
  const std::vector<Material> &list = b.composition.materials;
  return std::any_of(list.begin(), list.end(), [](const Material &m) { return m.entry(kTearKey, 0) > 0; });
}

bool cut_by_any(const Body &b) {
  const auto &tools = b.world->tools;
  return b.ahead.delay > 0 ||
         std::any_of(tools.begin(), tools.end(), [&](auto &t) { return t->cuts_body(b); });
}

}  // namespace dfm
