#include "dynamics/stiffness.h"

#include <algorithm>
#include <vector>

#include "core/error.h"

namespace dfm {

ModelStiffness::ModelStiffness(const Memory &memory) { use_memory(memory, pairs_, blocks_); }

void ModelStiffness::create(const ModelInstance &model, uint32_t npoint) {
  const dfm_model &ops = *model.ops;
  const char *const id = model.type->id;
  if (!offered(model))
    fail(DFM_E_UNSUPPORTED,
         "model '%s' has no stiffness, which implicit steps and static mode need; choose another model, or "
         "the integrator symplectic_euler",
         id);
  if (!ops.pattern || !ops.stiffness)
    fail(DFM_E_UNSUPPORTED,
         "model '%s' claims a stiffness but has no function for it; report it to its author", id);
  npoint_ = npoint;
  uint32_t nb = 0;
  if (model.call("pattern", [&] { return ops.pattern(model.self, &nb, nullptr); }) != DFM_OK)
    fail(DFM_E_FATAL, "model '%s' failed to give the pattern of its stiffness matrix; see the log", id);
  pairs_.assign(2 * size_t{nb}, 0);
  blocks_.assign(9 * size_t{nb}, 0.0);
  if (model.call("pattern", [&] { return ops.pattern(model.self, &nb, pairs_.data()); }) != DFM_OK ||
      2 * size_t{nb} != pairs_.size())
    fail(DFM_E_FATAL, "model '%s' failed to give the pattern of its stiffness matrix; see the log", id);
  std::vector<uint64_t> keys(nb);
  uint32_t own = 0;
  for (uint32_t b = 0; b < nb; ++b) {
    const uint32_t i = pairs_[2 * size_t{b}], j = pairs_[2 * size_t{b} + 1];
    if (i > j || j >= npoint)
      fail(DFM_E_FATAL,
           "model '%s' lists the points (%u, %u) as a block of its stiffness, expected i <= j "
           "below %u; report it to its author",
           id, i, j, npoint);
    own += i == j;
    keys[b] = uint64_t{i} << 32 | j;
  }
  std::sort(keys.begin(), keys.end());
  if (own != npoint || std::adjacent_find(keys.begin(), keys.end()) != keys.end())
    fail(DFM_E_FATAL,
         "model '%s' lists a block of its stiffness twice, or lacks that of a point with itself; "
         "report it to its author",
         id);
  constant_ = model.can(DFM_CAP_CONSTANT_STIFFNESS);
}

bool ModelStiffness::evaluate(const ModelInstance &model, const dfm_kin &k, double a, double b) {
  std::fill(blocks_.begin(), blocks_.end(), 0.0);
  const auto query = [&] { return model.ops->stiffness(model.self, &k, a, b, blocks_.data()); };
  return model.call("stiffness", query) == DFM_OK;
}

}  // namespace dfm
