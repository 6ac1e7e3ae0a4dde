// One step, from top to bottom:
//
//   bound                            if it is due: sizes of the sub-steps (step_bound.cpp, step_sizes.cpp)
//   sub-steps                        take_substeps(): equal ones, more of them if the bound has fallen
//                                    until the budget is used up; explicit from an impact on (impact.cpp)
//     pieces                         advance(), take_substep(): shorter where the guard requires it
//       stages                       sub_step(): all rows of the table that the plan has chosen,
//                                    or none
//         Next::woken                narrow has met bodies that sleep: catch_up(), narrow again
//         Next::solve                rigid commit: a host requests another solve, or rigid things move
//                                    otherwise than soft bodies know (rigid.cpp); guard: with the pairs that
//                                    would cross (guard.cpp)
#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "plugin/context.h"
#include "state/bounds.h"
#include "state/world.h"
#include "step/contact_step.h"
#include "step/context.h"
#include "step/impact.h"
#include "step/messages.h"
#include "step/move_obstacles.h"
#include "step/overlap/overlap.h"
#include "step/rigid/tools.h"
#include "step/solve/attach.h"
#include "step/solve/cut_drag.h"
#include "step/stages.h"
#include "step/step_bound.h"
#include "step/step_impulses.h"
#include "step/watch/energy_watch.h"

namespace dfm {
namespace {

// The part of the world, or of the buffers of a step, that has this type.
template <class P>
P part(World &w, StepContext &step, uint32_t *trouble) {
  using Part = std::remove_cvref_t<P>;
  if constexpr (std::is_same_v<Part, uint32_t *>) return trouble;
  else if constexpr (std::is_same_v<Part, Budget>) return step.budget;
  else if constexpr (std::is_same_v<Part, StepImpulses>) return w.step_impulses;
  else if constexpr (std::is_base_of_v<Part, World>) return w;
  else return step;
}
template <class R, class... P>
Next call(R (*stage)(P...), World &w, StepContext &step, uint32_t *trouble) {
  if constexpr (std::is_same_v<R, Next>) {
    return stage(part<P>(w, step, trouble)...);
  } else if constexpr (std::is_same_v<R, bool>) {
    return go_on(stage(part<P>(w, step, trouble)...));
  } else {
    stage(part<P>(w, step, trouble)...);
    return Next::stage;
  }
}
template <auto stage>
Next called(World &w, StepContext &step, uint32_t *trouble) {
  return call(stage, w, step, trouble);
}
template <class R, class... P>
constexpr bool takes_all(R (*)(P...)) {
  return (std::is_same_v<std::remove_cvref_t<P>, World> || ...) ||
         (std::is_same_v<std::remove_cvref_t<P>, StepContext> || ...);
}
template <auto stage>
constexpr Stage row(const char *name, const char *cost, StageChoice (*when)(const SceneFacts &),
                    StageRole role = StageRole::none, decltype(Stage::check) check = nullptr) {
  return {name,
          [](World &w, StepContext &step, uint32_t *trouble) { return call(stage, w, step, trouble); },
          cost,
          when,
          role,
          check,
          takes_all(stage)};
}

constexpr Stage kTable[] = {
    row<stage_motion>("motion", "what is prescribed", when::motion),
    row<stage_model>("model", "cells", when::model),
    row<stage_predict>("predict", "points", when::predict, StageRole::none, watch_energy),
    row<stage_rigid_predict>("rigid predict", "rigid bodies", when::rigid_predict),
    row<stage_gather>("gather", "points of surfels", when::gather),
    row<stage_broad>("broad", "surfels every sub-step; triangles whenever a skin is used up", when::broad,
                     StageRole::lists_pairs),
    row<stage_narrow>("narrow", "candidate pairs", when::narrow, StageRole::finds_contacts),
    row<stage_self>("self contact",
                    "surfels every sub-step, and what of them is near; triangles whenever a skin is used up",
                    when::self),
    row<stage_solve>("contact+friction", "contacts x sweeps, laws once per pass", when::solve,
                     StageRole::solves),
    row<stage_rigid_commit>("rigid commit", "rigid bodies", when::rigid_commit),
    row<stage_distribute>("distribute", "contacts and surfels", when::distribute,
                          StageRole::reports_impulses),
    row<stage_guard>("guard", "candidate pairs that may come nearer than d_c / 2 within the sub-step",
                     when::guard, StageRole::guards),
    row<stage_commit>("commit", "points", when::commit),
    row<stage_sleep>("sleep", "velocities of bodies that are awake", when::sleep),
};
static_assert(std::count_if(std::begin(kTable), std::end(kTable),
                            [](const Stage &stage) { return stage.takes_all; }) <= 3,
              "a stage takes the parts that it reads and writes");

using Clock = std::chrono::steady_clock;

// Runs a row of the table, with timing and tracing. since: in, end of the row before; out, of this one.
Next run(size_t row, World &w, StepContext &step, uint32_t *trouble, Clock::time_point &since) {
  const Stage &stage = kTable[row];
  struct Timer {
    const Stage &stage;
    World &w;
    StageTime &time;
    Clock::time_point &since;
    ~Timer() {
      w.context->trace_end(stage.name);
      const Clock::time_point now = Clock::now();
      time.seconds += std::chrono::duration<double>(now - since).count();
      ++time.calls;
      since = now;
    }
  };
  w.context->trace_begin(stage.name);
  const Timer timer{stage, w, step.stage_times[row], since};
  return stage.take(w, step, trouble);
}

bool advance(World &w, StepContext &step, double end, double goal, bool last, uint32_t *trouble);
bool take_substep(World &w, StepContext &step, uint32_t *trouble);
bool sub_step(World &w, StepContext &step, uint32_t *trouble);

}  // namespace

std::span<const Stage> stage_table() { return kTable; }

Plan make_plan(const SceneFacts &facts) {
  Plan plan;
  plan_effects(facts, plan);
  plan.on_bodies = when::acts(facts);
  for (size_t row = 0; row < std::size(kTable); ++row) {
    StageChoice choice = kTable[row].when(facts);
    if (choice.runs) plan.stages.push_back({row, kTable[row].role, std::move(choice.why)});
    else if (!choice.why.empty()) plan.absent.push_back({kTable[row].name, std::move(choice.why)});
  }
  return plan;
}

namespace {

// Sub-steps that a step of dt needs, at the present bound (infinite if there is none).
double least_sub_steps(const World &w, double dt) { return std::ceil(dt / w.bound.step - 1e-9); }

// The step needs more than max_substeps, and nothing has moved yet.
dfm_status refuse_step(World &w, double dt, uint32_t *trouble) {
  const Body *const b = w.bound.body;
  const bool steps_itself = b && b->model.stepper;
  const bool springs = !b || (!steps_itself && b->integrator.used != DFM_INTEGRATOR_SYMPLECTIC_EULER);
  fail_step(
      trouble, DFM_TROUBLE_SUBSTEPS,
      "a step of %g s needs %g sub-steps of %g s (max_substeps %u): %s%s body '%s', whose point %u bounds "
      "the step, %s, or take a shorter step",
      dt, least_sub_steps(w, dt), w.bound.step, w.def.max_substeps,
      !springs && !steps_itself && b->model.can(DFM_CAP_STIFFNESS)
          ? "let bodies move by tr_bdf2 or implicit_euler, "
          : "",
      springs ? "soften the springs that pull" : "soften or coarsen", b ? b->name.c_str() : "?",
      w.bound.point, springs ? "damp them less" : "lower its damping");
  return DFM_DISCARD;
}
// The bound has fallen so far within the step that the rest of it needs too many.
dfm_status refuse_rest(World &w, double goal) {
  set_last_error(format("%s: by its shape or its contacts body '%s' has come to need sub-steps so short "
                        "that the rest of the step takes %g of %g s (max_substeps %u); take a shorter step",
                        at_step(w).c_str(), w.bound.body ? w.bound.body->name.c_str() : "?",
                        std::ceil((goal - w.time) / w.bound.step), w.bound.step, w.def.max_substeps)
                     .c_str());
  return DFM_E_DIVERGED;
}

// Where a body has become explicit or implicit within the step, and before it.
void prepare_bound(World &w) {
  prepare(w);
  update_bound(w);
}

// What attachments that have come off held may touch from the next piece on. The bound keeps its age, so that
// it is followed also where something comes off all the time.
void prepare_released(World &w) {
  if (!part_released(w)) return;
  const WorldBound bound = w.bound;
  prepare(w);
  w.bound = bound;
}

// The rest of a step, from `from` to `goal`, in `n` equal sub-steps, of which the first `taken` are done.
struct Division {
  double from, span, goal;
  uint32_t n, taken;

  Division(double now, double dt, uint32_t count) : from(now), span(dt), goal(now + dt), n(count), taken(0) {}
  // Into `count` sub-steps from now on.
  void again(double now, uint32_t count) {
    from = now;
    span = goal - now;
    n = count;
    taken = 0;
  }
  bool over() const { return taken == n; }
  uint32_t left() const { return n - taken; }
  double size() const { return span / n; }
  bool last() const { return taken + 1 == n; }
  double next() const { return last() ? goal : from + span * (double(taken + 1) / n); }  // s, its end
};

// The rest of the step in sub-steps of the present bound.
void divide_rest(World &w, Division &rest) {
  rest.again(w.time, uint32_t(choose_substeps(w.sizes, rest.goal - w.time, w.bound.step)));
}

// An impact that costs too many sub-steps ends, and is not begun again. done: sub-steps of this step; returns
// how many more it needs.
double end_costly_impact(World &w, StepContext &step, uint32_t done, Division &rest, double more) {
  if (done + more <= w.def.max_substeps || !end_impact(w)) return more;
  prepare_bound(w);
  step.offered = 0;
  divide_rest(w, rest);
  return rest.left();
}

// The bound evaluated again, if it is due: more sub-steps where it has fallen.
dfm_status follow_bound(World &w, StepContext &step, uint32_t done, Division &rest, uint32_t *trouble) {
  if (!bound_expired(w)) return DFM_OK;
  update_bound(w);
  if (w.bound.inverted) *trouble |= DFM_TROUBLE_INVERTED;
  const double finer = cut_finer(w.sizes, rest.size(), w.bound.step);
  const double more = end_costly_impact(w, step, done, rest, rest.left() * finer);
  if (!(done + more <= w.def.max_substeps)) return refuse_rest(w, rest.goal);
  if (!(more > rest.left())) return DFM_OK;
  if (!(w.watch.size_before > 0)) w.watch.size_before = rest.size();
  rest.again(w.time, static_cast<uint32_t>(more));
  *trouble |= DFM_TROUBLE_SUBSTEPS;
  return DFM_OK;
}

// All sub-steps of a step of dt, at first n, until the budget is used up. done: how many were taken.
dfm_status take_substeps(World &w, StepContext &step, double dt, uint32_t n, uint32_t &done,
                         uint32_t *trouble) {
  struct Taken {  // also where this fails or throws
    World &w;
    double start;
    uint32_t &done;
    ~Taken() {
      take_back_work(w, start);
      w.stats.last_substeps = done;
      w.stats.substeps_max = std::max(w.stats.substeps_max, done);
      w.stats.time = w.time;
      w.step_impulses.length = w.time - start;
    }
  } taken{w, w.time, done};
  for (Division rest(w.time, dt, n); !rest.over();) {
    if (const dfm_status refused = follow_bound(w, step, done, rest, trouble)) return refused;
    allow_for_bound(w, step);
    step.budget.to_come = rest.left() - 1;
    step.length.most_parts = std::max(0.0, double(w.def.max_substeps) - done) / rest.left();
    const double from = w.time;
    if (!advance(w, step, rest.next(), rest.goal, rest.last(), trouble)) {
      if (!step.in_impact) return DFM_E_DIVERGED;
      begin_impact(w);
      prepare_bound(w);
      divide_rest(w, rest);
      end_costly_impact(w, step, done, rest, rest.left());
      *trouble |= DFM_TROUBLE_SUBSTEPS;
      continue;
    }
    ++done;
    pass(w.sizes, w.time - from);
    if (step.budget.ended) break;
    ++rest.taken;
    if (step.length.parts > 1) {  // after a hard impact: this sub-step was a finer one, too
      rest.again(w.time, (rest.left() + 1) * static_cast<uint32_t>(step.length.parts) - 1);
      *trouble |= DFM_TROUBLE_SUBSTEPS;
    }
  }
  return DFM_OK;
}

}  // namespace

dfm_status run_step(World &w, StepContext &step, double dt, uint32_t *trouble) {
  step.offered = chosen_by_library(w, dt) ? dt : 0;
  drop_released(w);
  prepare(w);
  save_at_once(w, step);
  check_target_speeds(w, dt);
  check_tool_ways(w, dt);
  release_overlaps(w);
  if (!std::exchange(w.overlaps.reported, true)) *trouble |= DFM_TROUBLE_OVERLAP;
  if (bound_expired(w)) update_bound(w);
  if (!(least_sub_steps(w, dt) <= w.def.max_substeps) && end_impact(w)) prepare_bound(w);
  if (!(least_sub_steps(w, dt) <= w.def.max_substeps)) return refuse_step(w, dt, trouble);
  const double size_before = w.sizes.cut.size;
  const uint32_t n = static_cast<uint32_t>(std::min<double>(
      w.def.max_substeps, choose_substeps(w.sizes, dt, w.bound.step, contact_step(w, step, dt))));
  w.watch.size_before = differ(w.sizes.cut.size, size_before) ? size_before : 0;
  plan_work(w, step, n);
  if (n > 1) *trouble |= DFM_TROUBLE_SUBSTEPS;
  if (w.bound.inverted) *trouble |= DFM_TROUBLE_INVERTED;

  begin_impulses(w.step_impulses, w.time, dt);
  begin_tools(w, dt);
  const double start = w.time;
  uint32_t done = 0;
  if (const dfm_status failed = take_substeps(w, step, dt, n, done, trouble)) return failed;
  drop_released(w);
  end_tools(w, w.time - start);
  ++w.step_count;
  w.stats.steps = w.step_count;
  follow_impact(w, w.time - start);
  return DFM_OK;
}

namespace {

// One planned sub-step, up to `end`: as a whole, or in pieces if the guard shortens it. last: it is the last
// of the step, which ends at `goal`.
bool advance(World &w, StepContext &step, double end, double goal, bool last, uint32_t *trouble) {
  step.guard.cuts = 0;
  step.length.begin(end - w.time);
  double planned = step.length.planned;
  for (bool whole = false; !whole;) {
    step.guard.motion = 1;
    prepare_released(w);
    step.rest = step.h = end - w.time;
    step.left = goal - w.time;
    // only where the budget of the step has room for one piece more
    if (step.length.next_piece > 0 && step.length.next_piece < step.rest &&
        may_repeat(w, w, step, step.budget))
      step.h = step.length.next_piece;
    view_obstacles(w, step);
    // waking changes state that a later failure must restore
    if (step.h < step.left || (w.def.sleep && !all_idle(w, step))) save_start(w, step);
    charge(w, step, 1);
    wake_attached(w, step);
    wake_cut(w, step);
    if (all_idle(w, step)) {
      w.stats.contacts_mean += (w.stats.contacts - w.stats.contacts_mean) / double(w.stats.substeps + 1);
      w.step_impulses.idle += step.h;
    } else if (!take_substep(w, step, trouble)) return false;
    if (step.length.planned != planned) {
      planned = step.length.planned;
      end = w.time + planned;
      last = false;
    }
    whole = step.h == step.rest;
    if (step.guard.motion < 1) move_obstacles_by(w, step, step.guard.motion);
    else move_obstacles(w, step, whole && last);
    w.time = whole ? end : w.time + step.h;
    w.stats.guard_lost += (1 - step.guard.motion) * step.h;
    ++w.stats.substeps;
    ++w.bound.age;
    if (ends_here(w, step) && !(whole && last)) return true;
  }
  step.budget.ended = false;
  return true;
}

// After a hard impact (doc/decisions/explicit_time.md) planned sub-steps are shorter from this one on. So
// this one is a whole sub-step, not a piece.
void refine(World &w, StepContext &step) {
  StepLength &length = step.length;
  step.budget.to_come = (step.budget.to_come + 1) * uint32_t(length.parts) - 1;
  cut_finer(w.sizes, length.planned, length.planned / length.parts);
  if (!(w.watch.size_before > 0)) w.watch.size_before = length.planned;
  length.planned = step.rest = length.planned / length.parts;
}

// Repeats until bodies and contacts are consistent, and h is short enough for the guard.
bool take_substep(World &w, StepContext &step, uint32_t *trouble) {
  const uint32_t before = *trouble;
  struct Undo {
    World &w;
    StepContext &step;
    ~Undo() { undo_waking(w, step); }
  } undo{w, step};
  step.roused.bodies.clear();
  step.guard.acted = false;
  begin_bodies(w, step);
  StepLength &length = step.length;
  bool grows = length.next_piece > 0;
  while (!sub_step(w, step, trouble)) {
    if (!length.repeats && !step.in_impact) return false;
    *trouble = before;
    if (step.in_impact) return false;
    grows = grows || length.grows;
    if (length.divides) refine(w, step);
    step.h *= length.factor;
    save_start(w, step);
    view_obstacles(w, step);
  }
  if (grows) length.next_piece = 2 * step.h;
  w.stats.guard_steps += step.guard.acted;
  step.guard.memory.keep();
  step.roused.bodies.clear();
  return true;
}

// Wakes the islands of sleeping bodies that contacts meet; stages model to broad for them.
bool catch_up(World &w, StepContext &step, uint32_t *trouble) {
  step.woken.clear();
  for (const uint32_t slot : step.met) wake(w, *w.bodies[slot]);
  std::ranges::sort(step.woken);
  struct Restored {
    World &w;
    ~Restored() { gather_active(w); }
  };
  {
    const Restored all{w};
    step.active.swap(step.woken);
    for (const auto stage : {called<stage_model>, called<stage_predict>, called<stage_gather>})
      if (stage(w, step, trouble) != Next::stage) return false;
  }
  return called<stage_broad>(w, step, trouble) == Next::stage;
}

// The place of a role among the planned stages.
size_t place_of(const Plan &plan, StageRole role) {
  const auto has = [&](const PlannedStage &s) { return s.role == role; };
  return size_t(std::find_if(plan.stages.begin(), plan.stages.end(), has) - plan.stages.begin());
}

// All stages or none: if one fails or throws, the state is that before the sub-step.
bool sub_step(World &w, StepContext &step, uint32_t *trouble) {
  struct Undo {
    World &w;
    StepContext &step;
    bool kept = false;
    ~Undo() {
      if (!kept) undo_motion(step.driven);
    }
  } undo{w, step};
  step.driven.clear();
  step.guard.start();
  step.length.begin_attempt();
  step.ended = step.in_impact = false;
  step.rigid_rounds = 0;
  step.rigid_again = false;
  step.residual = {};
  step.budget.rows = w.store.n;
  const uint64_t damping = w.sizes.damping > 0 ? 2 : 0;  // evaluations of the forces
  charge(w, step, (1 + damping) * body_work(w, step) + surface_work(w, step));
  Clock::time_point since = Clock::now();
  for (size_t at = 0; at < w.plan.stages.size();) {
    const Next next = run(w.plan.stages[at].row, w, step, trouble, since);
    if (next == Next::stop || (next == Next::woken && !catch_up(w, step, trouble))) return false;
    if (next == Next::solve) at = place_of(w.plan, StageRole::solves);
    if (next == Next::stage) ++at;
  }
  keep_rigids(w, step);
  if (step.residual.required > 1) {
    *trouble |= DFM_TROUBLE_UNCONVERGED;
    ++w.stats.unconverged;
  }
  return undo.kept = true;
}

}  // namespace

}  // namespace dfm
