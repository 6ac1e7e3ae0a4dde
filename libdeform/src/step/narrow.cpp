// Contacts of the sub-step, without depths that cannot be. A contact of a sleeper wakes its island, whose
// bodies then take the stages that the others have passed, model to broad, before contacts are found again.
#include <algorithm>
#include <cmath>

#include "contact/reach.h"
#include "narrow/narrow_phase.h"
#include "state/world.h"
#include "step/context.h"
#include "step/stages.h"

namespace dfm {
namespace {

// m, of d_c: where a surface is nearer than this, rounding may decide the side. The guard keeps twice as far
// away, except where surfaces start nearer.
constexpr double kClearly = 0.25;

// Side a's weights are not negative and side b's not positive: no feature is taken for longer than it is.
bool within(const StepContext &step, const ContactPoint &c) {
  const BodyView &a = step.body_views[c.slot_a];
  for (uint32_t k = 0; k < c.nnode; ++k) {
    const bool of_a = c.node[k] - a.first_node < a.surface->nsurfel;
    if (of_a ? c.weight[k] < 0 : c.weight[k] > 0) return false;
  }
  return true;
}

// A surfel's contact with a face, on the side of the face where the surfel is. False: out of reach.
bool turn_over(const StepContext &step, double offset, ContactPoint &c) {
  const BodyView &a = step.body_views[c.slot_a], &b = step.body_views[c.slot_b];
  const Vec3 v = load3(&a.surface->v[4 * size_t{c.feature_a}]);
  double speed2 = 0;
  for (uint32_t k = 1; k < c.nnode; ++k)
    speed2 = std::max(speed2, norm2(v - load3(&b.surface->v[4 * size_t{c.node[k] - b.first_node}])));
  c.distance = -c.distance;
  store3(c.normal, -load3(c.normal));
  return c.distance < contact_reach(step.h, offset, std::sqrt(speed2));
}

// Where two bodies do not cross, nothing has come through a surface. What is behind a face lies outside all
// the same: the face looks inward, because its surface is folded through itself. To lead it out through the
// face is what the guard prevents, and the impulses of the two would grow without bound
// (doc/decisions/0413-depths-that-cannot-be.md).
void turn_false_depths(World &w, StepContext &step) {
  if (!w.plan.has(StageRole::guards)) return;
  const auto is_false = [&](const ContactPoint &c) {
    return !c.obstacle && c.distance < -kClearly * w.offset && (c.kind == kVertexFace || within(step, c)) &&
           !cross_at_start(step, std::min(c.slot_a, c.slot_b), std::max(c.slot_a, c.slot_b), false);
  };
  std::erase_if(step.contacts, [&](ContactPoint &c) {
    if (!is_false(c)) return false;
    return c.kind != kVertexFace || !within(step, c) || !turn_over(step, w.offset, c);
  });
}

}  // namespace

bool stage_narrow(World &w, StepContext &step, uint32_t *trouble) {
  struct Restored {
    World &w;
    ~Restored() { gather_active(w); }
  };
  for (;;) {
    find_contacts(step.body_views, step.obstacle_views, step.broad.candidates(), step.h, w.offset,
                  w.store.crossings, step.lent, step.contacts, &step.narrow, &w.context->tasks);
    turn_false_depths(w, step);
    step.woken.clear();
    if (w.sleepers == 0) return true;
    for (const ContactPoint &c : step.contacts) {
      if (w.bodies[c.slot_a]->slumber.asleep) wake(w, *w.bodies[c.slot_a]);
      if (!c.obstacle && w.bodies[c.slot_b]->slumber.asleep) wake(w, *w.bodies[c.slot_b]);
    }
    if (step.woken.empty()) return true;
    std::sort(step.woken.begin(), step.woken.end());
    {
      const Restored all{w};
      step.active.swap(step.woken);
      const SubStep now = sub_step_of(w, step);
      if (!stage_model(w, step.active, now, trouble)) return false;
      if (!stage_predict(w, step.active, now, step.free_kinetic, trouble)) return false;
      stage_gather(w, step.active);
    }
    row::broad(w, step, trouble);
  }
}

}  // namespace dfm
