// The limit on the cost of a step, and how it is kept; doc/concepts/budget.md. Work is counted in units that
// depend on the state alone (points, cells, swept contacts), so that a step is simplified or shortened by its
// count on every machine, with any number of threads.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "core/memory.h"
#include "deform/world.h"

namespace dfm {

struct StepContext;
struct Awake;
struct Derived;
struct Entities;
struct World;

struct Budget {
  uint64_t work = 0, limit = 0;  // units of the present step; limit 0: not planned yet
  // Units that the step takes beside them, from what is free: that of the stable step.
  uint64_t other_work = 0;
  // Whether the limit is divided: each sub-step has its share, beside what the others need. The default limit
  // is not, because it ends steps that would not end.
  bool divided = false;
  uint32_t to_come = 0;    // planned sub-steps after the present one
  uint64_t rows = 0;       // of the present sub-step's contacts; of the last one until they are known
  uint64_t solve_end = 0;  // units of the present step at which the present contact solve ends
  // s of the steady clock at which the time of the step is used up; 0: no limit
  double end = 0;
  double span = 0;         // s, from the start of the step to `end`
  bool cheapened = false;  // the step has left something out
  bool ended = false;      // the step ends before its end: the budget is used up
  bool kept = false;       // `start` holds the state before this step
  std::string start;
  dfm_world_stats stats{};  // before the step
};

// One step within its budget: at least one sub-step of it, or one piece of that (Budget::ended). Returns the
// results of run_step(), or DFM_DISCARD if a stop was requested; the state is then that before the step.
dfm_status step_within_budget(World &w, double dt, uint32_t *trouble);

// Called by run_step(): the step will have this number of sub-steps.
void plan_work(World &w, StepContext &step, uint32_t substeps);
// Whether the step has used its budget: what may end within a sub-step, ends.
bool is_used_up(const StepContext &step);
// After a sub-step or a piece of one: whether the step ends here, because the budget does not hold another.
bool ends_here(const World &w, StepContext &step);
// At the start of each sub-step.
void allow_for_bound(const World &w, StepContext &step);
// Before a contact solve: its share of what the rest of the step does not need.
void share_work(const World &w, StepContext &step);
// Adds units, and throws if a stop was requested. Called by the stepping thread only, never while threads of
// a stage run.
void charge(World &w, StepContext &step, uint64_t units);
// The work of one island of the contact solve, on any thread. An island knows the work before all islands,
// and assumes that other islands use as much per row as itself, so what it leaves out does not depend on
// threads and timing.
struct Spent {
  uint64_t work = 0;
  uint64_t all = 1, own = 1;  // rows of all islands, of this one
  bool ended = false;         // the solve of the island has ended before it was done
};
// Adds units. Throws if a stop was requested, as charge() will.
void spend(const World &w, const StepContext &step, Spent &spent, uint64_t units);
// Whether the solve of the island is to end.
bool solve_ends(const StepContext &step, Spent &spent);
void charge(World &w, StepContext &step, const Spent &spent);  // after all islands, by the stepping thread
// Units of one pass over the bodies that are awake: points and cells; surfels.
uint64_t body_work(const Entities &entities, const Awake &awake);
uint64_t surface_work(const Entities &entities, const Awake &awake);
// Whether the budget holds these, beside the least work of what follows. If not, the step has left something
// out: the present sub-step repeated as a shorter piece; as one of `finer` for each that is planned; its
// contact solve repeated; another check by the guard.
bool may_repeat(const Entities &entities, const Derived &derived, const Awake &awake, Budget &budget);
bool may_refine(const World &w, StepContext &step, double finer);
bool may_solve_again(const World &w, StepContext &step, size_t hits);
bool may_check(const World &w, StepContext &step);
// Everything that steps change; between two steps the saved state is restored. Bodies and their dynamics are
// the same.
void write_down(World &w, StepContext &step, std::string &out);
void restore_start(World &w, StepContext &step, std::string_view from);
// After prepare(), whose results an interrupt leaves: what every step changes before it moves anything.
void save_at_once(World &w, StepContext &step);
// The whole state before the step is saved once, before any of it changes.
void save_start(World &w, StepContext &step);

// Requests the present step of a world (or the next one, if none runs) to stop. Async-signal-safe. Returns
// false if too many requests are pending.
bool request_stop(uint64_t world) noexcept;
void forget_stop(uint64_t world) noexcept;  // for a world that is destroyed

}  // namespace dfm
