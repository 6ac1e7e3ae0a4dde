// Contacts of the sub-step, without impossible depths, and the sleeping bodies that they meet: these wake.
#include <algorithm>

#include "narrow/narrow_phase.h"
#include "plugin/context.h"
#include "state/world.h"
#include "step/context.h"
#include "step/stages.h"

namespace dfm {
namespace {

// Share of d_c: if a surface is nearer than this, rounding may decide the side. The guard keeps twice this
// distance, unless surfaces start nearer.
constexpr double kClearly = 0.25;

bool of_surfel_and_face(const ContactPoint &c) { return c.obstacle ? c.type_a != 1 : c.kind == kVertexFace; }

// For two bodies: whether the edges cross between their ends, without extending them.
bool edges_cross(const Views &views, const ContactPoint &c) {
  const BodyView &a = views.body_views[c.slot_a];
  for (uint32_t k = 0; k < c.nnode; ++k) {
    const bool of_a = c.node[k] - a.first_node < a.surface->nsurfel;
    if (of_a ? c.weight[k] < 0 : c.weight[k] > 0) return false;
  }
  return true;
}

// Where two surfaces do not cross, no point has passed through one of them. So a point behind a face lies
// outside: the face looks inward, because its surface is folded through itself. A contact that leads the
// point through the face works against the guard, and the impulses of both would grow without bound
// (doc/decisions/contact_problem.md).
void drop_false_depths(const Derived &derived, const Views &views, Detection &detection) {
  if (!derived.plan.has(StageRole::guards)) return;
  const auto is_false = [&](const ContactPoint &c) {
    if (!(c.distance < -kClearly * derived.offset)) return false;
    if (c.obstacle) {
      if (views.obstacle_views[c.slot_b].shape != Shape::mesh || !of_surfel_and_face(c)) return false;
      return !cross_at_start(views, detection, c.slot_a, c.slot_b, true);
    }
    const auto [low, high] = std::minmax(c.slot_a, c.slot_b);
    return (of_surfel_and_face(c) || edges_cross(views, c)) &&
           !cross_at_start(views, detection, low, high, false);
  };
  std::erase_if(detection.contacts, is_false);
}

}  // namespace

Next stage_narrow(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                  const Derived &derived, const SubStepTimes &times, Views &views, Detection &detection,
                  Awake &awake) {
  for (const uint32_t i : awake.active) views.body_views[i].speed = detection.broad.speed(i);
  const bool known = derived.plan.has(StageRole::guards);
  if (known) follow_pairs(memory, derived, views, detection, false);
  find_contacts(views.body_views, views.obstacle_views, detection.broad.candidates(), times.h, derived.offset,
                state.store.crossings, detection.lent, detection.contacts, &detection.narrow,
                &memory.context->tasks, known ? &detection.guard.memory : nullptr);
  for (const uint32_t i : awake.active) views.body_views[i].speed = -1;
  drop_false_depths(derived, views, detection);
  awake.met.clear();
  if (derived.sleepers == 0) return Next::stage;
  const auto meet = [&](uint32_t slot) {
    if (entities.bodies[slot]->sleep_state.asleep) awake.met.push_back(slot);
  };
  for (const ContactPoint &c : detection.contacts) {
    meet(c.slot_a);
    if (!c.obstacle) meet(c.slot_b);
  }
  return awake.met.empty() ? Next::stage : Next::woken;
}

}  // namespace dfm
