// The stages of a sub-step, and shared functions. The table has their order (step/step.cpp), which no stage
// changes: Next says what has to run again. A stage takes the parts of the world and of the buffers of a step
// that it reads (const) and writes. Return false or Next::stop if the sub-step failed; `trouble` and
// dfm_last_error() give the reason, and nothing of it has been committed.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "broad/broad_phase.h"
#include "deform/world.h"
#include "dynamics/dynamics.h"
#include "math/vec3.h"
#include "plan/plan.h"
#include "state/world_bound.h"

namespace dfm {

struct Body;
struct Budget;
struct ContactPoint;
struct LawInstance;
struct StepImpulses;
// parts of the world (state/world.h)
struct Derived;
struct Entities;
struct Rules;
struct World;
struct WorldMemory;
struct WorldState;
// parts of the buffers of a step (step/context.h)
struct Awake;
struct Detection;
struct FreeMotions;
struct Solution;
struct StepContext;
struct SubStepEnd;
struct SubStepTimes;
struct Views;

// What follows a stage.
enum class Next {
  stage,  // the one behind it
  woken,  // bodies are met that sleep: they wake and catch up with the others, and the stage runs again
  solve,  // the contact solve once more, and what is behind it
  stop,   // the sub-step has failed, or is to be repeated (StepLength::repeats)
};
inline Next go_on(bool succeeded) { return succeeded ? Next::stage : Next::stop; }

// A row of the table of stages, which is in the order of a sub-step.
struct Stage {
  const char *name;
  Next (*run)(World &w, StepContext &step, uint32_t *trouble);
  const char *cost;                              // what its cost grows with
  StageChoice (*when)(const SceneFacts &facts);  // whether it runs, and why
  StageRole role = StageRole::none;
  // Observes the result and steers nothing. False: the sub-step fails.
  bool (*check)(World &w, StepContext &step, uint32_t *trouble) = nullptr;
  bool takes_all = false;  // of the world, or of the buffers of a step, in place of parts

  Next take(World &w, StepContext &step, uint32_t *trouble) const {
    const Next next = run(w, step, trouble);
    return next == Next::stage && check ? go_on(check(w, step, trouble)) : next;
  }
};
std::span<const Stage> stage_table();
Plan make_plan(const SceneFacts &facts);  // throws Error if nothing provides a requested effect

// Choices that prepare() would make again but a restored world keeps, because they were made at an earlier
// state.
struct RestoredChoice {
  Vec3 gravity;
  WorldBound bound;
  double offset;
};
// Updates plan, pair tables, offset and views of the entities; does nothing if nothing has changed. Throws
// Error.
void prepare(World &w, const RestoredChoice *restored = nullptr);
// An integrator of second order where the equations are solved: at the steps that implicit time is for,
// backward Euler damps the oscillation of a body within one period
// (doc/decisions/implicit_time.md).
ImplicitOptions implicit_choice(const World &w, const Body &b);
uint32_t implicit_integrator(const World &w, const Body &b);  // DFM_INTEGRATOR_*, of that
// After a change of values that no table depends on: loads, motions, gravity, parameters of a model or of
// a law. The step bound is recomputed, the energy balance restarts, and the next prepare() checks the plan.
void values_changed(World &w);
// In the next prepare() the library chooses again the integrators that are left to it.
void reopen_integrators(World &w);
void set_gravity_now(World &w);  // from its keys, at the present time
dfm_status run_step(World &w, StepContext &step, double dt, uint32_t *trouble);

// A held velocity component set by this sub-step.
struct Driven { double *velocity, before; };

// Held points go straight to where they have to be at the end of the planned sub-step, as obstacles do
// (Obstacle::end_pose).
void stage_motion(const WorldState &state, Entities &entities, Rules &rules, const SubStepTimes &times,
                  FreeMotions &motions);
// b.p.load at time t; loads that nothing varies over time times share. Springs are not in it.
void set_loads(Body &b, double t, double share);
// Prescribed positions of moving held points at time t.
void each_held_place(const Body &b, double t, const std::function<void(uint32_t point, Vec3 to)> &use);
void undo_motion(Array<Driven> &driven);  // held velocities as before stage_motion()
// free_motion.cpp
bool stage_model(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                 const Rules &rules, const SubStepTimes &times, const Awake &awake, uint32_t *trouble);
bool stage_predict(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                   const Rules &rules, const Derived &derived, const SubStepTimes &times, const Awake &awake,
                   FreeMotions &motions, uint32_t *trouble);
void stage_gather(const WorldMemory &memory, const Entities &entities, const Awake &awake);
void stage_broad(const WorldMemory &memory, const Derived &derived, const SubStepTimes &times,
                 const Views &views, Detection &detection);
// narrow.cpp
Next stage_narrow(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                  const Derived &derived, const SubStepTimes &times, Views &views, Detection &detection,
                  Awake &awake);
// self_contact.cpp
void stage_self(const Derived &derived, const SubStepTimes &times, Views &views, Detection &detection);
// rigid.cpp; end states are stored separately until keep_rigids()
bool stage_rigid_predict(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                         const Rules &rules, const Derived &derived, const Awake &awake, SubStepTimes &times,
                         Budget &budget, Views &views, Solution &solution, uint32_t *trouble);
Next stage_rigid_commit(const WorldMemory &memory, WorldState &state, const Entities &entities,
                        const Derived &derived, const Awake &awake, const Detection &detection,
                        SubStepTimes &times, Budget &budget, Views &views, Solution &solution,
                        StepImpulses &impulses, uint32_t *trouble);
// solve.cpp
void stage_distribute(const Detection &detection, const Solution &solution, SubStepEnd &end);
// sleep.cpp
void stage_sleep(WorldState &state, Entities &entities, const Rules &rules, Derived &derived,
                 const SubStepTimes &times, const Detection &detection, const Solution &solution,
                 Views &views, SubStepEnd &end, Awake &awake);
// These take the whole world: bodies, laws and hosts respond to each other in a solve, the guard solves
// again, and all is committed.
bool stage_solve(World &w, StepContext &step, uint32_t *trouble);   // solve.cpp
Next stage_guard(World &w, StepContext &step, uint32_t *trouble);   // guard.cpp
bool stage_commit(World &w, StepContext &step, uint32_t *trouble);  // commit.cpp

SubStep sub_step_of(const WorldState &state, const Rules &rules, const SubStepTimes &times);
void begin_bodies(World &w, StepContext &step);  // before a sub-step and its repetitions
// Distributes the present impulses of the rows to the points of bodies.
void report_impulses(const Detection &detection, const Solution &solution, SubStepEnd &end);
// Computes the end states of all active bodies with the distributed impulses; the present states are kept.
bool find_ends(World &w, StepContext &step, uint32_t *trouble);
void keep_rigids(World &w, StepContext &step);  // after the sub-step has succeeded

// solve.cpp
// Makes rows from contacts, with their stored data.
bool make_rows(World &w, StepContext &step, uint32_t *trouble);
// m, of a depth: the part that the contact was found with, less what has opened of it. It counts as distance.
// match: of the contact in the store; kNone: the most that its pair has left.
double start_depth(const World &w, const StepContext &step, const ContactPoint &c, uint32_t match,
                   double depth);
// As fail_step(). law: failed at this contact, or kNone; null: a value is not finite.
bool report_failed_solve(World &w, StepContext &step, const LawInstance *law, uint32_t contact,
                         uint32_t *trouble);
// As fail_step(): the contact solve has no solution, and nothing can move any further. row: names what jams;
// kNone: the one of a soft body that carries most.
bool report_jam(const WorldState &state, const Entities &entities, const Detection &detection,
                const Solution &solution, const Views &views, uint32_t row, uint32_t *trouble);
void reserve_contacts(World &w, StepContext &step);  // memory for keep_contacts()
// Reserves memory of lists to which keep_contacts() and keep_rigids() add.
void reserve_reports(WorldState &state, const Entities &entities, const Derived &derived, const Views &views,
                     const Solution &solution, StepImpulses &impulses);
void keep_contacts(World &w, StepContext &step);  // store, events, hold, work; allocates nothing
// all, with their events, if the plan has no stage for contacts
void end_contacts(World &w);
void reserve_events(WorldState &state, size_t more);
void add_event(World &w, uint32_t kind, uint64_t a, uint64_t b, uint64_t key, double t);  // a, b: ids
void add_friction_work(World &w, uint64_t a, uint64_t b, double joule);                   // a, b: ids

// sleep.cpp
uint32_t slot_of(const Entities &entities, uint64_t id);           // of a body, or kNone
uint32_t obstacle_slot_of(const Entities &entities, uint64_t id);  // of an obstacle, or kNone
void gather_active(Entities &entities, Derived &derived, Views &views, SubStepEnd &end, Awake &awake);
void gather_active(World &w);
// waking and falling asleep allocate nothing, and cannot fail
void reserve_sleep(World &w, StepContext &step, uint32_t n);
void wake(World &w, Body &b);  // and its island
void wake_all(World &w);
void undo_waking(World &w, StepContext &step);  // of the sub-step, which has failed
void wake_touching(World &w, uint64_t obstacle);
bool all_idle(const World &w, const StepContext &step);
void carry_sleepers(World &w, StepContext &step, uint32_t *touching, uint32_t *sticking);
void hold_sleepers(World &w);  // hold_begin() while contacts sleep

}  // namespace dfm
