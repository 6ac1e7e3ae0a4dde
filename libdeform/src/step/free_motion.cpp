// The motion of bodies and their surfaces without contact: stages model, predict, gather, broad.
#include <algorithm>
#include <cmath>

#include "body/make_surface.h"
#include "core/error.h"
#include "plugin/context.h"
#include "plugin/on_behalf.h"
#include "state/bounds.h"
#include "step/by_body.h"
#include "step/context.h"
#include "step/first_failure.h"
#include "step/stages.h"

namespace dfm {

SubStep sub_step_of(const World &w, const StepContext &step) {
  const Vec3 before =
      w.gravity.keys.empty() ? w.gravity.now : vector_at(w.gravity.keys, w.prescribed.at(w.time));
  return {w.time, step.h, w.gravity.now, kLight, before};
}

// Decided by the stored contacts, so that a restored world does the same.
void begin_bodies(World &w, StepContext &step) {
  if (!step.bodies_part) return;
  step.near.assign(w.bodies.size(), 0);
  for (uint32_t m = 0; m < w.store.n; ++m)
    for (const uint64_t id : {w.store.id_a[m], w.store.id_b[m]})
      if (const uint32_t i = slot_of(w, id); i != kNone) step.near[i] = 1;
  for (const Attachment &a : w.attachments)
    for (const uint64_t id : {a.body, a.to})
      if (const uint32_t i = slot_of(w, id); i != kNone && !a.released) step.near[i] = 1;
  for (size_t i = 0; i < w.bodies.size(); ++i) w.bodies[i]->dynamics->begin(step.near[i]);
}

namespace {
// From this number of cells on models divide their work among all threads themselves.
constexpr size_t kLargeBody = 10000;
bool fewer_than_threads_and_large(const World &w, Active active) {
  return active.size() < w.context->tasks.threads() &&
         std::ranges::all_of(active, [&](uint32_t i) { return w.bodies[i]->tets.size() >= 4 * kLargeBody; });
}
}  // namespace

bool stage_model(World &w, Active active, const SubStep &now, uint32_t *trouble) {
  FirstFailure failed;
  const auto forces = [&](uint32_t begin, uint32_t end) {
    for (const uint32_t i : active.subspan(begin, end - begin)) {
      const OnBehalf prefix(w.bodies[i]->name);
      // booked with them: work of what holds driven points, and what another size of sub-steps changes
      const bool keep = !w.bodies[i]->motions.empty() || w.watch.size_before > 0;
      if (!w.bodies[i]->dynamics->add_forces(now, keep)) failed.note(i);
    }
  };
  const uint32_t n = static_cast<uint32_t>(active.size());
  if (fewer_than_threads_and_large(w, active)) forces(0, n);
  else
    w.context->tasks.parallel_for(n, bodies_together(w, active, kPointsToPull),
                                  [&](uint32_t begin, uint32_t end) { forces(begin, end); });
  if (failed.body == kNone) return true;
  *trouble |= report_no_forces(w, *w.bodies[failed.body]);
  return false;
}

uint32_t report_no_forces(const World &w, const Body &b) {
  set_last_error(format("step %llu, body '%s': model '%s' could not compute its forces; take a smaller step "
                        "or change the model",
                        static_cast<unsigned long long>(w.step_count), b.name.c_str(), b.model.type->id)
                     .c_str());
  return DFM_TROUBLE_PLUGIN;
}

namespace {
// A model that steps itself has refused: called again while its log is captured, so that its reason becomes
// the error.
bool tells_why(const World &w, const Body &b, const SubStep &now) {
  if (!b.model.stepper) return false;
  const Overheard why;
  double kinetic = 0;
  if (b.dynamics->free_motion(now, kinetic) || !*why.text()) return false;
  set_last_error(format("step %llu, body '%s': %s", static_cast<unsigned long long>(w.step_count),
                        b.name.c_str(), why.text())
                     .c_str());
  return true;
}
}  // namespace

bool stage_predict(World &w, Active active, const SubStep &now, Array<double> &kinetic, uint32_t *trouble) {
  const bool touches = w.plan.touches();
  FirstFailure failed;
  const auto move = [&](uint32_t begin, uint32_t end) {
    for (const uint32_t i : active.subspan(begin, end - begin)) {
      Body &b = *w.bodies[i];
      const OnBehalf prefix(b.name);
      if (!b.dynamics->free_motion(now, kinetic[i])) failed.note(i);
      if (touches && b.surface.identity())
        gather_surface(b.surface, b.p.x.data(), b.dynamics->point_velocity());
    }
  };
  w.context->tasks.parallel_for(static_cast<uint32_t>(active.size()),
                                bodies_together(w, active, kPointsToMove),
                                [&](uint32_t begin, uint32_t end) { move(begin, end); });
  if (failed.body == kNone) return true;
  const Body &b = *w.bodies[failed.body];
  if (tells_why(w, b, now)) {
    *trouble |= DFM_TROUBLE_PLUGIN;
    return false;
  }
  *trouble |= DFM_TROUBLE_NONFINITE;
  const size_t n = b.dynamics->point_velocity() ? b.p.n : b.surface.nsurfel;
  const double speed = largest_coordinate(b.dynamics->contact_velocity(), n, kStride);
  const std::string what = speed > kLight && std::isfinite(speed)
                               ? format("a point would move at %.3g m/s, faster than light", speed)
                               : "forces or velocities are not finite";
  set_last_error(format("step %llu, body '%s': %s (model '%s'); take a smaller step, or look for loads and "
                        "parameters that are too large",
                        static_cast<unsigned long long>(w.step_count), b.name.c_str(), what.c_str(),
                        b.model.type->id)
                     .c_str());
  return false;
}

// Surfels coupled to several phyxels: rows of N are independent, so they are divided among the threads.
void stage_gather(World &w, Active active) {
  for (const uint32_t i : active) {
    const auto &b = w.bodies[i];
    if (b->surface.identity()) continue;
    const double *const v = b->dynamics->point_velocity();
    w.context->tasks.parallel_for(b->surface.nsurfel, 1024, [&](uint32_t begin, uint32_t end) {
      gather_rows(b->surface, b->p.x.data(), v, begin, end);
    });
  }
}

void stage_broad(std::span<const BodyView> bodies, std::span<const ObstacleView> obstacles,
                 const PairFilter &filter, double h, double offset, Tasks &tasks, BroadPhase &out) {
  try {
    out.update(bodies, obstacles, filter, h, offset, &tasks);
  } catch (...) {
    out.clear();  // out of memory while making its lists: they are rebuilt next time
    throw;
  }
}

}  // namespace dfm
