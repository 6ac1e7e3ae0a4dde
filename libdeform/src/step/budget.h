// What one step may cost, and what stops it on its way; doc/concepts/budget.md. Work is counted in units that
// depend on the state alone (points, cells, contacts swept), so that a step that is cheapened or discarded by
// its count is so on every machine, with any number of threads.
#pragma once
#include <cstdint>
#include <vector>

#include "core/memory.h"
#include "deform/world.h"

namespace dfm {

struct StepContext;
struct World;

// What a step leaves out once it has used this much of its budget. Each entry contains those before it.
enum class Thrift { none, polish, sweeps, pieces };

struct Budget {
  uint64_t work = 0, limit = 0;  // units of the present step; limit 0: not planned yet
  // s of the steady clock at which the step has used its time; 0: it may take any
  double end = 0;
  double span = 0;             // s, from the start of the step to `end`
  Thrift used = Thrift::none;  // the furthest that this step has gone
  bool kept = false;           // `start` holds the state before this step
  std::vector<unsigned char> start;
  dfm_world_stats stats{};  // before the step
};

// One step within its budget. Besides what World::step() returns: DFM_DISCARD where the budget is used up or
// somebody asked the step to stop; the state is then as before the step.
dfm_status step_within_budget(World &w, double dt, uint32_t *trouble);

// Of World::step(): the step is going to be cut into so many sub-steps.
void plan_work(World &w, StepContext &step, uint32_t substeps);
// Adds units and throws where the step has to end here. Called by the stepping thread only, never while
// another stage's threads run.
void charge(World &w, StepContext &step, uint64_t units);
// What one island of the contact solve uses, on whatever thread solves it. It knows what had been used before
// the islands, and takes the others to use as much per row as it does itself: what it leaves out does not
// depend on who solves what, or when.
struct Spent {
  uint64_t work = 0;
  uint64_t all = 1, own = 1;  // rows of all islands, of this one
  Thrift used = Thrift::none;
  double effort = 0;  // multiplications of sweeps over bodies whose points answer each other
};
// Adds units. Throws where the step has to end here, as charge() will for what has been spent.
void spend(const World &w, const StepContext &step, Spent &spent, uint64_t units);
bool spares(const StepContext &step, Spent &spent, Thrift what);
void charge(World &w, StepContext &step, const Spent &spent);  // after all islands, by the stepping thread
// Units of one pass over the bodies that are awake: points and cells; surfels.
uint64_t body_work(const World &w, const StepContext &step);
uint64_t surface_work(const World &w, const StepContext &step);
// Does the step go without this by now? Counts as used where it is so.
bool spares(StepContext &step, Thrift what);
// All that steps change, between two steps; what has been written down is put back as it was. The bodies are
// the same and move as they did.
void write_down(World &w, StepContext &step, std::vector<unsigned char> &out);
void put_back(World &w, StepContext &step, const std::vector<unsigned char> &from);
// The state before the step is written down, once, before anything of it changes.
void keep_start(World &w, StepContext &step);

// Asks the present step of a world, or if none runs the next one, to stop. Async-signal-safe. False: too many
// requests wait.
bool request_stop(uint64_t world) noexcept;
void forget_stop(uint64_t world) noexcept;  // of a world that goes

}  // namespace dfm
