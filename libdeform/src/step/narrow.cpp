// Contacts of the sub-step. A contact of a sleeper wakes its island, whose bodies then take the stages that
// the others have passed, model to broad, before contacts are found once more.
#include <algorithm>

#include "narrow/narrow_phase.h"
#include "state/world.h"
#include "step/context.h"
#include "step/stages.h"

namespace dfm {

bool stage_narrow(World &w, StepContext &step, uint32_t *trouble) {
  struct Restored {
    World &w;
    ~Restored() { gather_active(w); }
  };
  for (;;) {
    find_contacts(step.body_views, step.obstacle_views, step.broad.candidates(), step.h, w.offset,
                  w.store.crossings, step.lent, step.contacts, &step.narrow, &w.context->tasks);
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
