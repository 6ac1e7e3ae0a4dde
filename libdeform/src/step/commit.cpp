// The end of the sub-step: contact impulses on points, then positions and velocities.
#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin/on_behalf.h"
#include "step/by_body.h"
#include "step/context.h"
#include "step/impact.h"
#include "step/messages.h"
#include "step/solve/attach.h"
#include "step/solve/cut_drag.h"
#include "step/solve/solve_islands.h"
#include "step/stages.h"
#include "step/step_bound.h"
#include "step/step_impulses.h"
#include "step/watch/energy_watch.h"

namespace dfm {

namespace {
// Between this sub-step and the next.
bool reads_points(const World &w, const Body &b) {
  return w.def.sleep || b.changes.open || !b.switches.empty() || !b.rule.empty() ||
         !w.overlaps.suspended.empty();
}

bool has_impulses(const World &w, const StepContext &step) {
  return w.plan.has(StageRole::reports_impulses) && step.rows.all() > 0;
}

constexpr double kAlong = 0.1;  // of the stable step: a way on which strains change little

// What a host's changes of the step put into bodies (doc/decisions/energy_watch.md).
void damp_changes_of_size(World &w, const StepContext &step) {
  const double stable = w.bound.step / kBoundShare, c = next_damping(w.sizes, step.length.planned, stable);
  if (!(c > 0)) return;
  each_active(w, w, step.active, kPointsToPull, [&](Body &b) {
    if (b.dynamics->unknowns().diagonal) b.dynamics->damp(w.time + step.h, c, kAlong * stable);
    return true;
  });
}
}  // namespace

bool find_ends(World &w, StepContext &step, uint32_t *trouble) {
  const SubStep now = sub_step_of(w, w, step);
  const bool touched = has_impulses(w, step);
  const bool guarded = w.plan.has(StageRole::guards);
  if (guarded) step.guard.common.assign(w.bodies.size(), {});
  const Body *const failed = each_active(w, w, step.active, kPointsToMove, [&](Body &b) {
    if (guarded) check_motion(w, step, b.slot);
    return b.dynamics->end_state(now, b.surfel_impulse.data(), touched);
  });
  step.ended = true;
  if (!failed) return true;
  return fail_step(trouble, DFM_TROUBLE_PLUGIN,
                   "%s: model '%s' could not end its step, or ended it with something not finite; take a "
                   "smaller step or change the model",
                   at_step(w, *failed).c_str(), failed->model.type->id);
}

bool stage_commit(World &w, StepContext &step, uint32_t *trouble) {
  if (!step.ended && !find_ends(w, step, trouble)) return false;
  step.in_impact = has_impact(w, step);
  if (step.in_impact) return false;
  const SubStep now = sub_step_of(w, w, step);
  SubStep moved = now;
  moved.h *= step.guard.motion;
  if (step.guard.motion < 1) {
    const bool touched = has_impulses(w, step);
    step.in_full.clear();
    if (touched) take_part_of_contact(w, step, step.guard.motion);
    for (const uint32_t i : step.active) {
      Body &b = *w.bodies[i];
      const OnBehalf prefix(b.name);
      b.dynamics->take_part(step.guard.motion, step.acts_in_full(i),
                            touched ? b.surfel_impulse.data() : nullptr);
    }
  }
  book_energy(w, step, step.guard.motion);
  double accurate = std::numeric_limits<double>::infinity();
  for (const uint32_t i : step.active)
    accurate = std::min(accurate, w.bodies[i]->dynamics->accurate_step(now));
  w.sizes.accurate = std::isfinite(accurate) ? accurate : 0;
  each_active(w, w, step.active, kPointsToMove, [&](Body &b) {
    ready_change_work(b, now);
    b.dynamics->commit(moved);
    if (reads_points(w, b)) b.dynamics->see_points();
    ++b.x_version;
    b.sleep_state.h = 0;
    book_change_work(w, b, now.h);
    if (!w.plan.touches()) return true;
    Vec3 sum;
    for (uint32_t s = 0; s < b.surface.nsurfel; ++s) sum += load3(&b.surfel_impulse[3 * size_t(s)]);
    b.contact_impulse += sum;
    return true;
  });
  if (w.plan.touches()) {
    end_idle(w);
    keep_contacts(w, step);
    keep_bonds(w, step);
    keep_cut_drags(w, step);
    add_impulses(w, w.store);
  }
  damp_changes_of_size(w, step);
  return true;
}

}  // namespace dfm
