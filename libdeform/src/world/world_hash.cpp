// What the results of later steps depend on, in one number.
#include "core/hash.h"
#include "dynamics/rigid/rigid_set.h"
#include "state/world.h"
#include "world/body_model.h"
#include "world/snapshot.h"

namespace dfm {

uint64_t world_hash(const World &w) {
  Hash h;
  for (auto &b : w.bodies) {
    for (const Array<double> *a : {&b->p.x, &b->p.v, &b->p.dampers.v, &b->model.state})
      h.add(a->data(), a->size() * sizeof(double));
  }
  for (auto &set : w.rigid_sets) {
    h.add(set->state.data(), set->state.size() * sizeof(dfm_rigid_state));
    h.add(set->extra.data(), set->extra.size() * sizeof(double));
  }
  for (const ContactStore *const store : {&w.store, &w.tool_store})
    each_column(
        [&](const ContactColumn &column, const auto &values) {
          if (column.hashed) h.add(values.data(), values.size() * sizeof(values[0]));
        },
        *store);
  if (w.def.sleep)
    for (auto &b : w.bodies) {
      h.add(b->slumber.asleep);
      h.add(b->slumber.calm);
      h.add(b->slumber.since);
    }
  // where it is another one than at the first step: until then it follows from how the world was made
  for (auto &b : w.bodies)
    if (const uint64_t model = model_hash(*b); model != b->first_model) {
      h.add(b->id);
      h.add(model);
    }
  return h.value;
}

}  // namespace dfm
