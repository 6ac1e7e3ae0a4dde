#include "step/budget.h"

#include <array>
#include <atomic>
#include <chrono>

#include "body/make_surface.h"
#include "core/byte_stream.h"
#include "core/error.h"
#include "dynamics/rigid/rigid_set.h"
#include "plugin/context.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "state/world.h"
#include "step/context.h"
#include "step/impact.h"
#include "step/messages.h"
#include "step/overlap/overlap.h"
#include "step/rigid/tool_touch.h"
#include "step/stages.h"
#include "step/step_bound.h"

namespace dfm {
namespace {

// Shares at which contact solves of the step end, and at which it goes without guard pieces: of max_time, and
// of a budget that is not divided.
constexpr double kFewSweepsAt = 0.5, kNoCutsAt = 0.75;
// Share of its sub-step's units at which a contact solve ends; the rest is left to solves that the guard
// repeats.
constexpr double kSolveShare = 0.9;
// Default limit: this factor times the cost of the planned sub-steps without contact.
constexpr uint64_t kAutomaticFactor = 16000;
constexpr uint64_t kRigidWork = 1000;  // of a rigid body, in the automatic limit

constexpr const char *kStart = "saved start of a step";

struct StepInterrupted {};

// Worlds that were requested to stop. A signal may arrive while a lock is held, so no lock is used; 0: free.
constexpr size_t kMaxRequests = 64;
std::array<std::atomic<uint64_t>, kMaxRequests> requests{};
std::atomic<uint32_t> waiting{0};
static_assert(std::atomic<uint64_t>::is_always_lock_free && std::atomic<uint32_t>::is_always_lock_free);

void take_request(uint64_t world) noexcept {
  for (auto &r : requests) {
    uint64_t is = world;
    if (r.compare_exchange_strong(is, 0)) waiting.fetch_sub(1);
  }
}

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

bool requested(uint64_t world) noexcept {
  return waiting.load(std::memory_order_relaxed) != 0 &&
         std::any_of(requests.begin(), requests.end(), [&](const auto &r) { return r.load() == world; });
}

double used_time(const Budget &b) { return b.end > 0 ? 1 - (b.end - now()) / b.span : 0; }

// Units per row, where a sweep is one and the laws at a state are four: what a contact solve should have at
// least, what the end of the present one is given, and the least of any.
constexpr uint64_t kDefaultSolve = 36, kEndOfSolve = 24, kMinSolve = 12;
// What the guard should have: the check of the way, and one of the safe part of it, without which nothing
// moves. The barest sub-step has the first alone.
constexpr uint64_t kDefaultChecks = 2, kMinChecks = 1;
// A stable step is evaluated as fast as this share of the points and cells moves.
constexpr double kBoundShareOfWork = 0.5;

uint64_t checks(const Entities &entities, const Derived &derived, const Awake &awake, uint64_t number) {
  return derived.plan.has(StageRole::guards) ? number * surface_work(entities, awake) : 0;
}

// What a sub-step needs that has as many contacts as the last one: with the default solve and checks, or with
// the least.
uint64_t sub_step_work(const Entities &entities, const Derived &derived, const Awake &awake, const Budget &b,
                       uint64_t number = kDefaultChecks, uint64_t solve = kDefaultSolve) {
  return 1 + body_work(entities, awake) + surface_work(entities, awake) +
         checks(entities, derived, awake, number) + solve * b.rows;
}
uint64_t default_work(const World &w, const StepContext &step) {
  return sub_step_work(w, w, step, step.budget);
}
uint64_t min_work(const World &w, const StepContext &step) {
  return sub_step_work(w, w, step, step.budget, kMinChecks, kMinSolve);
}

uint64_t substeps_to_come(const StepContext &step) {
  return uint64_t{step.budget.to_come} + (step.h < step.rest);
}

bool holds(Budget &b, uint64_t units) {
  const bool is_left =
      b.divided ? b.work + units <= b.limit : !(double(b.work) > kNoCutsAt * double(b.limit));
  if (is_left && !(used_time(b) > kNoCutsAt)) return true;
  b.cheapened = true;
  return false;
}

// One list of what a step changes is used for saving and restoring. Memory for restoring is reserved in
// advance.
template <class Stream>
void changing(Stream &s, World &w) {
  s.one(w.time);
  s.one(w.offset);
  s.many(w.overlaps.found);
  s.one(w.step_count);
  s.one(w.sleepers);
  for (auto &b : w.bodies) {
    s.many(b->p.x);
    s.many(b->p.v);
    s.many(b->p.dampers.v);
    s.many(b->p.dampers.slow);
    s.many(b->model.state);
    s.many(b->anchor);
    s.one(b->contact_impulse);
    s.one(b->sleep_state);
    for (BladeTrack &track : b->blades) s.many(track.cut_work);
  }
  for (auto &o : w.obstacles) {
    s.one(o->pose);
    s.one(o->has_target);
  }
  for (auto &set : w.rigid_sets) {
    s.many(set->state);
    s.many(set->extra);
    s.many(set->total);
    s.many(set->wrench);
  }
  for (auto *const store : {&w.store, &w.tool_store}) {
    s.one(store->n);
    s.one(store->nstate);
    s.one(store->h);
    each_column([&](const ContactColumn &, auto &column) { s.many(column); }, *store);
  }
  s.many(w.rigid_touching);
  for (Attachment &a : w.attachments) {
    s.many(a.impulse);
    s.one(a.h);
    s.one(a.total);
    s.one(a.released);
    s.one(a.parted);
  }
  s.many(w.work);
  s.count(w.events);  // steps only append to it, and the host may read it after many steps
}

// The stores are swapped with others at the end of sub-steps, so the saved data may have to fit into those.
void reserve_others(World &w, StepContext &step) {
  const auto reserve = [](const ContactColumn &, const auto &from, auto &to) { to.reserve(from.size()); };
  each_column(reserve, w.store, step.next_store);
  each_column(reserve, w.tool_store, step.tools->next());
  step.tools->next_touching().reserve(w.rigid_touching.size());
}

// Data that a sub-step changes before it is known whether more must be saved: an interrupt ends it before it
// moves anything.
template <class Stream>
void changed_at_once(Stream &s, World &w) {
  s.one(w.bound);
  s.one(w.gravity.now);
  s.one(w.watch);
  s.many(w.overlaps.suspended);
  s.one(w.overlaps.reported);
  s.many(w.step_impulses.pairs);
  s.one(w.step_impulses.start);
  s.one(w.step_impulses.length);
  s.one(w.step_impulses.idle);
  for (auto &b : w.bodies) {
    s.many(b->surfel_impulse);
    s.one(b->energy);
    s.one(b->changes);
    s.one(b->bound);
  }
  for (auto &set : w.rigid_sets) s.many(set->impulse);
  s.one(w.sizes);
  s.one(w.integrator_times.changes);
  for (auto &t : w.tools) {
    s.many(t->set->extra);
    s.one(t->cuts.waits);
  }
}

void restore_changing(ByteReader &from, World &w) {
  changing(from, w);
  for (auto &b : w.bodies) {
    ++b->x_version;
    if (b->sleep_state.asleep) gather_surface(b->surface, b->p.x.data(), b->p.v.data());
  }
  gather_active(w);
}

void return_to_start(World &w, StepContext &step) {
  for (const Attachment &a : w.attachments) w.changed = w.changed || a.parted;  // it holds again
  ByteReader from(step.budget.start, kStart);
  changed_at_once(from, w);
  if (step.budget.kept) {
    restore_changing(from, w);
    ByteReader first(step.budget.start, kStart);
    changed_at_once(first, w);  // of tools; the rest was saved after the step had changed them
  }
  keep_suspended(w);  // release_overlaps() may have let some touch
  const uint64_t cheapened = w.stats.cheapened;
  w.stats = step.budget.stats;
  w.stats.cheapened = cheapened;
  step.guard.forget();
}

}  // namespace

uint64_t body_work(const Entities &entities, const Awake &awake) {
  uint64_t sum = 1;
  for (const uint32_t i : awake.active) {
    const Body &b = *entities.bodies[i];
    sum += b.dynamics->abilities().work * (b.p.n + b.tets.size() / 4);
  }
  return sum;
}

uint64_t surface_work(const Entities &entities, const Awake &awake) {
  uint64_t sum = 1;
  for (const uint32_t i : awake.active) sum += entities.bodies[i]->surface.nsurfel;
  return sum;
}

// Fast free bodies may need hundreds of pieces where they meet, also in a world without soft bodies.
void plan_work(World &w, StepContext &step, uint32_t substeps) {
  uint64_t rigid = 0;
  for (const auto &set : w.rigid_sets) rigid += kRigidWork * set->defs.size();
  Budget &b = step.budget;
  b.rows = w.store.n;
  b.limit = w.def.max_work
                ? w.def.max_work
                : kAutomaticFactor * substeps * (body_work(w, step) + surface_work(w, step) + rigid);
  b.divided = w.def.max_work;
}

bool is_used_up(const StepContext &step) {
  const Budget &b = step.budget;
  return (b.limit && b.work > b.limit) || (b.end > 0 && now() > b.end);
}

bool ends_here(const World &w, StepContext &step) {
  Budget &b = step.budget;
  b.ended = is_used_up(step) || (b.divided && b.work + b.other_work + min_work(w, step) > b.limit);
  return b.ended;
}

// Whoever asks for the stable step between two steps has it evaluated there; that changes no later result.
void allow_for_bound(const World &w, StepContext &step) {
  if (bound_is_new(w)) step.budget.other_work += uint64_t(kBoundShareOfWork * double(body_work(w, step)));
}

void charge(World &w, StepContext &step, uint64_t units) {
  step.budget.work += units;
  if (requested(w.handle)) throw StepInterrupted{};
}

void share_work(const World &w, StepContext &step) {
  Budget &b = step.budget;
  b.rows = step.rows.all();
  if (!b.divided) {
    b.solve_end = uint64_t(kFewSweepsAt * double(b.limit));
    return;
  }
  const auto left_by = [&](uint64_t kept) { return b.limit > b.work + kept ? b.limit - b.work - kept : 0; };
  const uint64_t own = b.other_work + checks(w, w, step, kDefaultChecks) + kEndOfSolve * b.rows;
  // a budget that does not hold all sub-steps ends the step before its end
  const uint64_t standard = default_work(w, step),
                 follow = std::min(substeps_to_come(step), left_by(own) / standard);
  const double left = double(left_by(own + follow * standard));
  const double share = std::max(left / double(1 + follow), std::min(left, double(kDefaultSolve * b.rows)));
  b.solve_end = b.work + uint64_t(kSolveShare * share);
}

bool may_repeat(const Entities &entities, const Derived &derived, const Awake &awake, Budget &b) {
  return holds(b, b.other_work + (2 + uint64_t{b.to_come}) * sub_step_work(entities, derived, awake, b));
}

bool may_refine(const World &w, StepContext &step, double finer) {
  const uint64_t remaining = (1 + uint64_t{step.budget.to_come}) * uint64_t(finer);
  return holds(step.budget, step.budget.other_work + remaining * default_work(w, step));
}

bool may_solve_again(const World &w, StepContext &step, size_t hits) {
  const Budget &b = step.budget;
  return holds(step.budget, b.other_work + substeps_to_come(step) * default_work(w, step) +
                                checks(w, w, step, 1 + kDefaultChecks) + kDefaultSolve * (b.rows + hits));
}

bool may_check(const World &w, StepContext &step) {
  return !step.budget.divided ||
         holds(step.budget, substeps_to_come(step) * default_work(w, step) + checks(w, w, step, 1));
}

void spend(const World &w, const StepContext &, Spent &spent, uint64_t units) {
  spent.work += units;
  if (requested(w.handle)) throw StepInterrupted{};
}

bool solve_ends(const StepContext &step, Spent &spent) {
  const Budget &b = step.budget;
  if (b.work + spent.work * spent.all / spent.own > b.solve_end || used_time(b) > kFewSweepsAt)
    spent.ended = true;
  return spent.ended;
}

void charge(World &w, StepContext &step, const Spent &spent) {
  step.budget.cheapened = step.budget.cheapened || spent.ended;
  charge(w, step, spent.work);
}

void save_at_once(World &w, StepContext &step) {
  ByteWriter to(step.budget.start);
  changed_at_once(to, w);
}

void save_start(World &w, StepContext &step) {
  Budget &b = step.budget;
  if (b.kept) return;
  ByteWriter to(b.start);
  changing(to, w);
  reserve_others(w, step);
  b.kept = true;
}

void write_down(World &w, StepContext &step, std::string &out) {
  out.clear();
  ByteWriter to(out);
  to.one(w.stats);
  changed_at_once(to, w);
  changing(to, w);
  reserve_others(w, step);
}

void restore_start(World &w, StepContext &step, std::string_view from) {
  ByteReader at(from, kStart);
  at.one(w.stats);
  changed_at_once(at, w);
  restore_changing(at, w);
  step.guard.forget();
}

dfm_status step_within_budget(World &w, double dt, uint32_t *trouble) {
  StepContext &step = *w.steps;
  Budget &b = step.budget;
  b.work = b.limit = b.other_work = 0;
  b.kept = b.ended = b.cheapened = false;
  b.stats = w.stats;
  b.span = w.def.max_time;
  b.end = b.span > 0 ? now() + b.span : 0;
  b.start.clear();
  dfm_status status = DFM_DISCARD;
  const Tasks::Step awake(w.context->tasks);
  const double impact_until = w.impact_until;
  try {
    status = run_step(w, step, dt, trouble);
  } catch (const StepInterrupted &) {
    take_request(w.handle);
    return_to_start(w, step);
    undo_impact(w, impact_until);  // may fail, and changes dampers and sizes
    return_to_start(w, step);
    set_last_error((at_step(w) + " was interrupted; the state is as before the step").c_str());
    *trouble = DFM_TROUBLE_INTERRUPTED;
    ++w.stats.discarded;
  }
  if (b.ended) ++w.stats.shortened;
  if (b.cheapened) ++w.stats.cheapened;
  if (b.ended || b.cheapened) *trouble |= DFM_TROUBLE_BUDGET;
  if (w.events.size() > kMaxEvents)
    w.events.erase(w.events.begin(), w.events.end() - kMaxEvents + kEventsAtOnce);
  w.stats.work = b.work;
  w.stats.work_max = std::max(w.stats.work_max, b.work);
  return status;
}

bool request_stop(uint64_t world) noexcept {
  for (auto &r : requests)
    if (r.load() == world) return true;
  for (auto &r : requests) {
    uint64_t none = 0;
    if (r.compare_exchange_strong(none, world)) {
      waiting.fetch_add(1);
      return true;
    }
  }
  return false;
}

void forget_stop(uint64_t world) noexcept { take_request(world); }

}  // namespace dfm
