// The motion of bodies and their surfaces without contact: stages model, predict, gather, broad.
#include <algorithm>
#include <cmath>

#include "body/make_surface.h"
#include "plugin/context.h"
#include "state/bounds.h"
#include "step/by_body.h"
#include "step/context.h"
#include "step/messages.h"
#include "step/sides.h"
#include "step/stages.h"

namespace dfm {

SubStep sub_step_of(const WorldState &state, const Rules &rules, const SubStepTimes &times) {
  const Gravity &gravity = rules.gravity;
  const Vec3 before =
      gravity.keys.empty() ? gravity.now : vector_at(gravity.keys, rules.prescribed.at(state.time));
  return {state.time, times.h, gravity.now, kLight, before};
}

void begin_bodies(World &w, StepContext &step) {
  if (!step.bodies_part) return;
  step.near.assign(w.bodies.size(), 0);
  each_body_held(w, [&](uint32_t i) { step.near[i] = 1; });
  for (size_t i = 0; i < w.bodies.size(); ++i) {
    Body &b = *w.bodies[i];
    b.dynamics->choose_scheme(step.near[i]);
    if (b.dynamics->abilities().parts) b.p.load_before = b.p.load;
  }
}

namespace {
// From this number of cells on models divide their work among all threads themselves.
constexpr size_t kLargeBody = 10000;
bool fewer_than_threads_and_large(const WorldMemory &memory, const Entities &entities,
                                  std::span<const uint32_t> active) {
  return active.size() < memory.context->tasks.threads() &&
         std::ranges::all_of(
             active, [&](uint32_t i) { return entities.bodies[i]->tets.size() >= 4 * kLargeBody; });
}
}  // namespace

bool stage_model(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                 const Rules &rules, const SubStepTimes &times, const Awake &awake, uint32_t *trouble) {
  const SubStep now = sub_step_of(state, rules, times);
  const auto forces = [&](Body &b) {
    // booked with them: work of what holds driven points, and what another size of sub-steps changes
    const bool keep = !b.motions.empty() || state.watch.size_before > 0;
    return b.dynamics->add_forces(now, keep);
  };
  const uint32_t together =
      fewer_than_threads_and_large(memory, entities, awake.active) ? kOnThisThread : kPointsToPull;
  const Body *const failed = each_active(memory, entities, awake.active, together, forces);
  if (!failed) return true;
  return fail_step(trouble, DFM_TROUBLE_PLUGIN,
                   "%s: model '%s' could not compute its forces; take a smaller step or change the model",
                   at_step(state, *failed).c_str(), failed->model.type->id);
}

namespace {
// The reason of a model that steps itself and has refused: it is called again while its log is captured.
std::string reason_of(const Body &b, const SubStep &now) {
  if (!b.model.stepper) return {};
  const Overheard why;
  double kinetic = 0;
  return b.dynamics->free_motion(now, kinetic) ? std::string() : why.text();
}
}  // namespace

bool stage_predict(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                   const Rules &rules, const Derived &derived, const SubStepTimes &times, const Awake &awake,
                   FreeMotions &motions, uint32_t *trouble) {
  const SubStep now = sub_step_of(state, rules, times);
  const bool touches = derived.plan.touches();
  const Body *const failed = each_active(memory, entities, awake.active, kPointsToMove, [&](Body &b) {
    const bool moved = b.dynamics->free_motion(now, motions.free_kinetic[b.slot]);
    if (touches && b.surface.identity())
      gather_surface(b.surface, b.p.x.data(), b.dynamics->unknowns().of_points());
    return moved;
  });
  if (!failed) return true;
  const Body &b = *failed;
  if (const std::string why = reason_of(b, now); !why.empty())
    return fail_step(trouble, DFM_TROUBLE_PLUGIN, "%s: %s", at_step(state, b).c_str(), why.c_str());
  const Unknowns unknowns = b.dynamics->unknowns();
  const size_t n = unknowns.of_points() ? b.p.n : b.surface.nsurfel;
  const double speed = largest_coordinate(unknowns.velocity, n, kStride);
  const std::string what = speed > kLight && std::isfinite(speed)
                               ? format("a point would move at %.3g m/s, faster than light", speed)
                           : !unknowns.system || !std::isfinite(speed)
                               ? "forces or velocities are not finite"
                               : "its equations of motion were not solved, or forces are not finite";
  return fail_step(
      trouble, DFM_TROUBLE_NONFINITE,
      "%s: %s (model '%s'); take a smaller step, or look for loads and parameters that are too large",
      at_step(state, b).c_str(), what.c_str(), b.model.type->id);
}

// Surfels coupled to several phyxels: rows of N are independent, so they are divided among the threads.
void stage_gather(const WorldMemory &memory, const Entities &entities, const Awake &awake) {
  for (const uint32_t i : awake.active) {
    const auto &b = entities.bodies[i];
    if (b->surface.identity()) continue;
    const double *const v = b->dynamics->unknowns().of_points();
    memory.context->tasks.parallel_for(b->surface.nsurfel, 1024, [&](uint32_t begin, uint32_t end) {
      gather_rows(b->surface, b->p.x.data(), v, begin, end);
    });
  }
}

void stage_broad(const WorldMemory &memory, const Derived &derived, const SubStepTimes &times,
                 const Views &views, Detection &detection) {
  try {
    detection.broad.update(views.body_views, views.obstacle_views, derived.pairs.filter, times.h,
                           derived.offset, &memory.context->tasks);
  } catch (...) {
    detection.broad.clear();  // out of memory while making its lists: they are rebuilt next time
    throw;
  }
}

}  // namespace dfm
