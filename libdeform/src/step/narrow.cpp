// Contacts of the sub-step, without impossible depths. A contact of a sleeping body wakes its island.
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
bool edges_cross(const StepContext &step, const ContactPoint &c) {
  const BodyView &a = step.body_views[c.slot_a];
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
void drop_false_depths(World &w, StepContext &step) {
  if (!w.plan.has(StageRole::guards)) return;
  const auto is_false = [&](const ContactPoint &c) {
    if (!(c.distance < -kClearly * w.offset)) return false;
    if (c.obstacle) {
      if (step.obstacle_views[c.slot_b].shape != Shape::mesh || !of_surfel_and_face(c)) return false;
      return !cross_at_start(step, c.slot_a, c.slot_b, true);
    }
    return (of_surfel_and_face(c) || edges_cross(step, c)) &&
           !cross_at_start(step, std::min(c.slot_a, c.slot_b), std::max(c.slot_a, c.slot_b), false);
  };
  std::erase_if(step.contacts, is_false);
}

}  // namespace

Next stage_narrow(World &w, StepContext &step, uint32_t *) {
  for (const uint32_t i : step.active) step.body_views[i].speed = step.broad.speed(i);
  const bool known = w.plan.has(StageRole::guards);
  if (known) follow_pairs(w, step, false);
  find_contacts(step.body_views, step.obstacle_views, step.broad.candidates(), step.h, w.offset,
                w.store.crossings, step.lent, step.contacts, &step.narrow, &w.context->tasks,
                known ? &step.guard.memory : nullptr);
  for (const uint32_t i : step.active) step.body_views[i].speed = -1;
  drop_false_depths(w, step);
  step.woken.clear();
  if (w.sleepers == 0) return Next::stage;
  for (const ContactPoint &c : step.contacts) {
    if (w.bodies[c.slot_a]->sleep_state.asleep) wake(w, *w.bodies[c.slot_a]);
    if (!c.obstacle && w.bodies[c.slot_b]->sleep_state.asleep) wake(w, *w.bodies[c.slot_b]);
  }
  std::sort(step.woken.begin(), step.woken.end());
  return step.woken.empty() ? Next::stage : Next::woken;
}

}  // namespace dfm
