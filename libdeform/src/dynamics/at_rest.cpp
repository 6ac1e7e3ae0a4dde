#include "dynamics/at_rest.h"

#include <algorithm>

namespace dfm {

AtRest::AtRest(const Memory &memory, Phyxels &points, ModelInstance &model) : p_(points), model_(model) {
  use_memory(memory, zero_);
  zero_.assign(size_t{kStride} * p_.n, 0.0);
}

dfm_kin AtRest::kin(double time) const {
  return kin_at(time, kForever, p_.x.data(), zero_.data(), model_.state.data());
}

bool AtRest::add_forces(double time) {
  const dfm_kin k = kin(time);
  return model_.call("add_forces", [&] { return model_.ops->add_forces(model_.self, &k, p_.f.data()); }) ==
         DFM_OK;
}

bool AtRest::relax(double time) {
  if (model_.state.empty()) return false;
  dfm_kin k = kin(time);
  k.state_out = model_.state_out.data();
  std::fill(p_.f.begin(), p_.f.end(), 0.0);
  if (model_.call("add_forces", [&] { return model_.ops->add_forces(model_.self, &k, p_.f.data()); }) !=
      DFM_OK)
    return false;
  model_.commit_state();
  return true;
}

}  // namespace dfm
