// Derived data of the world between steps: names, pair tables, offset, plan.
#include "state/world.h"
#include "step/context.h"

#include <algorithm>

#include "core/background.h"
#include "plugin/context.h"
#include "state/material.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "step/pair_table.h"
#include "step/stages.h"

namespace dfm {

World::World(dfm_context *c)
    : WorldMemory{c, Meters(c->memory)},
      WorldState(meters.contacts.memory()),
      steps(std::make_unique<StepContext>(meters)) {
  use_memory(meters.contacts.memory(), step_impulses.pairs);
  stats.size = sizeof stats;
}

World::~World() = default;

Body *Entities::body(uint64_t id) const {
  const uint32_t i = slot_of(*this, id);
  return i == kNone ? nullptr : bodies[i].get();
}
Obstacle *Entities::obstacle(uint64_t id) const {
  const uint32_t i = obstacle_slot_of(*this, id);
  return i == kNone ? nullptr : obstacles[i].get();
}

Body *Entities::find_body(const std::string &name) {
  for (auto *list : {&bodies, &emptied})
    for (auto &b : *list)
      if (b->name == name) return b.get();
  return nullptr;
}

Obstacle *Entities::find_obstacle(const std::string &name) {
  for (auto &o : obstacles)
    if (o->name == name) return o.get();
  return nullptr;
}

uint64_t Entities::handle_of(uint64_t id) const {
  const auto among = [id](const auto &list) -> const Body * {
    const auto at = std::ranges::find(list, id, [](const auto &b) { return b->id; });
    return at != list.end() ? at->get() : nullptr;
  };
  if (const Body *const b = among(bodies)) return b->handle;
  if (const Body *const b = among(emptied)) return b->handle;
  if (const Obstacle *const o = obstacle(id)) return o->handle;
  const Body *const gone = among(rolled_back);  // last: what came after the restore may have its id
  return gone ? gone->handle : 0;
}

}  // namespace dfm
