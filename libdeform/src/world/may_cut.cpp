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
  if (!b.cells.empty())
    refuse(b, DFM_E_UNSUPPORTED,
           " can be neither cut nor torn: its cells are %s; give it a mesh of first-order tetrahedra",
           cell_kind(b.cell_type).name);
  if (!b.surface.identity())
    refuse(b, DFM_E_UNSUPPORTED,
           " can be neither cut nor torn: it has its own surface; create it with the boundary of its cells "
           "as surface (in a scene: \"surface\": {\"from\": \"boundary\"}), which is then drawn and touches: "
           "steps as large as its %u cells in place of %u triangles",
           b.ncell(), b.surface.ntri);
  if (b.scaling.moved > 0)
    refuse(b, DFM_E_UNSUPPORTED,
           " can be neither cut nor torn: mass has been moved between its points; create it without "
           "mass_scaling");
  if (!topology_of(model))
    refuse(b, DFM_E_UNSUPPORTED,
           " can be neither cut nor torn: model '%s' needs all of its cells; take msm or corotational_fem",
           model.type->id);
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
