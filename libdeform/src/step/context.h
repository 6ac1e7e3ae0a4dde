// Buffers of a step, by the stage that writes them. None of them is state, and none is in a snapshot. Lasting
// state is in World (state/world.h).
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "body/rigid_motion.h"
#include "broad/broad_phase.h"
#include "contact/areas.h"
#include "contact/contact_state.h"
#include "contact/distribute.h"
#include "contact/exchange.h"
#include "contact/renewal.h"
#include "contact/store.h"
#include "geometry/views.h"
#include "math/extent.h"
#include "narrow/narrow_phase.h"
#include "state/world.h"
#include "step/budget.h"
#include "step/guard.h"
#include "step/islands.h"
#include "step/stages.h"
#include "step/step_length.h"
#include "step/watch/energy_watch.h"

namespace dfm {

class ImplicitSystem;
struct RigidSet;
struct SelfBody;
struct SolveIsland;
class SolveIslands;
class ToolTouch;

struct RigidMember {
  RigidSet *set;
  uint32_t body;
};

struct StageTime {
  double seconds = 0;
  uint64_t calls = 0;
};

// Lengths of the present sub-step.
struct SubStepTimes {
  // s: length of the sub-step; from its start to the end of the step, and of the planned sub-step
  double h = 0, left = 0, rest = 0;
  StepLength length;
  double offered = 0;  // s, length of the step if the library has chosen it, else 0
};

// prepare(): the world's entities as the stages see them
struct Views {
  SceneFacts facts;  // what the plan was made from
  // how often prepare() has rebuilt these, and the plan
  struct { uint64_t tables = 0, plans = 0; } made;
  std::vector<BodyView> body_views;
  std::vector<ObstacleView> obstacle_views;
  std::vector<RigidPlace> rigid_places;    // by obstacle slot; empty without rigid bodies
  std::vector<uint32_t> rigid_groups;      // bodies per group, all sets
  std::vector<RigidMember> rigid_members;  // of one group after another
  std::vector<size_t> rigid_first;         // [groups + 1] into them
  std::vector<DofSource> sources;
  std::vector<ImplicitSystem *> systems;               // by body slot; null: not implicit
  std::vector<std::unique_ptr<SelfBody>> self_bodies;  // in id order; those that may touch themselves
  std::unique_ptr<ToolTouch> tools;                    // rigid things with each other
  Views();
  ~Views();
};

// motion, model, predict
struct FreeMotions {
  struct Motion {
    Extent place, velocity;  // m, m/s, of its surfels
    double edge;             // m
  };
  std::vector<Motion> surface_motions;  // [bodies] of contact_step()
  std::vector<uint32_t> triangles;      // near one of them
  Array<Driven> driven;
  Array<double> free_kinetic;   // [bodies] J, without contact; of this sub-step
  Array<EnergySample> samples;  // [active]
  // [bodies] where the guard takes a part of the motion: contact and forces act in full
  // (take_part_of_contact)
  Array<uint8_t> in_full;
  bool acts_in_full(uint32_t slot) const { return slot < in_full.size() && in_full[slot]; }
};

// broad, narrow, self contact
struct Detection {
  BroadPhase broad;
  Array<ContactPoint> contacts;
  Array<uint8_t> lent;  // scratch of the narrow phase
  NarrowBlocks narrow;
  Guard guard;  // what it knows of pairs serves the narrow phase
  explicit Detection(const Memory &memory) : broad(memory), narrow(memory) {}
};

// contact+friction
struct Solution {
  const Memory &contact_memory;
  ContactRows rows;
  Array<Bond> bonds;
  Array<double> bond_impulse;  // [bonds,3] N s, initial values of the next solve of this sub-step
  ContactState state;
  std::unique_ptr<SolveIslands> solve_islands;
  // Called for a program beside the library: before an island is solved, on its thread; with null after all
  // are.
  std::function<void(const SolveIsland *)> on_solve;
  struct { Array<double> normal, tangent; } tolerance;  // [contacts] of all islands
  Residual residual;                                    // the worst of all islands
  Array<double> start_residual, impulse_before_rebuild;
  Array<double> tangents;
  // [contacts] m/s, at which sides leave each other at least; empty where no pair has a restitution
  Array<double> rebound_speed;
  Array<RigidMotion> motions;  // [bodies] at the start of the sub-step, of those with such contacts
  Array<uint8_t> marked;       // [bodies] scratch of it
  // both empty where no law holds places (friction_memory.h)
  Array<double> slip_back;    // [contacts,2] m/s, slip that the solve takes back; of islands that owe
  Array<double> stick_drift;  // [contacts,3] m, slip since the contact sticks
  // [contacts] index of the contact in the store of the last sub-step, or kNone
  Array<uint32_t> match;
  bool bodies_part = false;  // the motion of some body depends on whether there are contacts
  struct Chosen {
    uint32_t law;
    double scale;  // of friction
    Vec3 belt;     // m/s
  };
  Array<Chosen> chosen;     // [contacts] by the host (PreSolve); empty without a callback
  Array<uint8_t> near;      // [bodies] had contacts in the last sub-step
  Array<uint8_t> touching;  // [bodies] touch something, between steps
  // a rigid host, or rows between rigid things, have changed their motion: the solve goes on from its last
  // impulses
  bool rigid_again = false;
  uint32_t rigid_rounds = 0;  // of solves that rigid things have requested
  AreaShares areas;
  AreaExchange exchange;
  // law of contacts whose areas follow the load, else kNone
  Array<uint32_t> sharing;
  bool shares = false;        // whether any law uses area
  Array<double> target_area;  // [contacts] m2, areas by the load, if so
  Renewal renewal;
  Array<uint8_t> keeps_area;  // [contacts] is loaded, and keeps its area
  Array<Renewal::Way> ways;
  Array<double> renewed;
  explicit Solution(const Memory &memory);
  ~Solution();
};

// distribute, guard, commit
struct SubStepEnd {
  std::vector<ImpulseSink> sinks;
  WrittenNodes given;
  bool ended = false;      // find_ends() has been called since the last solve
  bool in_impact = false;  // the sub-step is to be repeated explicitly (step/impact.h)
  Array<double> mean;      // [dofs of rows,4] m/s, over the sub-step; of bodies
  Array<uint8_t> before;   // [contacts] touched in the last sub-step
  // [contacts of the store] number of the contact that goes on from it, or kNone
  Array<uint32_t> goes_on;
  ContactStore next_store;  // trades places with the world's
  explicit SubStepEnd(const Memory &memory) : next_store(memory) {}
};

// sleep. If no body sleeps, `active` contains all bodies.
struct Awake {
  Islands islands;
  // slots of active bodies, ascending; of sleeping ones that contacts meet; of those that have woken
  Array<uint32_t> active, met, woken;
  Roused roused;
  Array<uint8_t> stirred;  // [island]
  explicit Awake(const Memory &memory) : islands(memory) {}
};

// A stage takes the parts that it reads and writes (step/step.cpp: part).
struct StepContext : SubStepTimes, Views, FreeMotions, Detection, Solution, SubStepEnd, Awake {
  Budget budget;
  std::vector<StageTime> stage_times;  // by row of the table

  explicit StepContext(const Meters &meters);
  ~StepContext();
};

}  // namespace dfm
