// Buffers of a step, by the stage that writes them. Nothing here is state, and no snapshot has any of it.
// What lasts is the World's (state/world.h).
#pragma once
#include <memory>
#include <vector>

#include "broad/broad_phase.h"
#include "contact/areas.h"
#include "contact/distribute.h"
#include "contact/exchange.h"
#include "contact/renewal.h"
#include "contact/store.h"
#include "geometry/views.h"
#include "narrow/narrow_phase.h"
#include "state/world.h"
#include "step/budget.h"
#include "step/counting.h"
#include "step/energy_watch.h"
#include "step/guard.h"
#include "step/islands.h"
#include "step/method.h"
#include "step/self_contact.h"
#include "step/solve_islands.h"
#include "step/stages.h"
#include "step/tool_touch.h"

namespace dfm {

struct StageTime {
  double seconds = 0;
  uint64_t calls = 0;
};

struct StepContext {
  // s: of the sub-step; from its start to the end of the step
  double h = 0, left = 0;
  Budget budget;
  Counting counting;
  std::vector<StageTime> stage_times;  // by row of the method's table

  // prepare(): the world's entities as the stages see them
  SceneFacts facts;  // what the plan was made from
  // how often prepare() has made all of this anew, and the plan
  struct { uint64_t tables = 0, plans = 0; } made;
  std::vector<BodyView> body_views;
  std::vector<ObstacleView> obstacle_views;
  std::vector<RigidPlace> rigid_places;  // by obstacle slot; empty without rigid bodies
  std::vector<uint32_t> rigid_groups;    // bodies per group, all sets
  std::vector<DofSource> sources;
  std::vector<std::unique_ptr<SelfBody>> self_bodies;  // in id order; those that may touch themselves

  // motion
  Array<Driven> driven;
  // predict
  Array<double> free_kinetic;  // [bodies] J, without contact; of this sub-step
  Array<EnergyLook> looks;     // [active]
  // broad, narrow, self
  BroadPhase broad;
  Array<ContactPoint> contacts;
  Array<uint8_t> lent;  // scratch of the narrow phase
  NarrowBlocks narrow;

  // contact <-> friction
  ContactRows rows;
  Array<Bond> bonds;
  Array<double> bond_impulse;  // [bonds,3] N s, that the next solve of this sub-step starts from
  ContactState state;
  SolveIslands solve_islands;
  struct { Array<double> normal, tangent; } tolerance;  // [contacts] of all islands
  Residual residual;                                    // the worst of all islands
  uint32_t passes = 0, sweeps = 0;                      // of the island that took most
  Array<double> disturbance, best_impulse, trial_response;
  Array<uint8_t> revised;  // [blocks of rows] the body answers otherwise by its impulses
  Array<double> tangents;
  // [contacts] place in the store that the contact goes on from, or kNone
  Array<uint32_t> match;
  Array<uint32_t> block_surfels;  // responses of bodies whose points answer each other
  bool bodies_revise = false;     // some body looks again at what the solve has made of it
  bool bodies_part = false;       // some body moves otherwise where contacts are
  struct Chosen {
    uint32_t law;
    double scale;  // of friction
    Vec3 belt;     // m/s
  };
  Array<Chosen> chosen;             // [contacts] by the host (PreSolve); empty where it is not asked
  Array<uint8_t> near;              // [bodies] had contacts in the last sub-step
  Array<uint8_t> touching;          // [bodies] touch something, between steps
  const Body *unsettled = nullptr;  // that has found no state with its contacts
  ToolTouch tools;                  // with each other
  // a host has answered, and the solve goes on from its last impulses
  bool rigid_again = false;
  AreaShares areas;
  AreaExchange exchange;
  // law of contacts whose areas follow the load, else kNone
  Array<uint32_t> sharing;
  bool shares = false;  // does any law count by area?
  Array<double> aim;    // [contacts] m2, what they should stand for, if so
  Renewal renewal;
  Array<uint8_t> stands;  // [contacts] carries, and has an area that it keeps
  Array<Renewal::Way> ways;
  Array<double> renewed;
  std::unique_ptr<MethodBuffers> method;  // of stages that the contact method has for itself

  // distribute, guard
  std::vector<ImpulseSink> sinks;
  bool ended = false;  // find_ends() has been asked since the last solve
  Guard guard;
  // commit
  Array<double> mean;  // [dofs of rows,4] m/s, over the sub-step; of bodies
  // trades places with the world's
  ContactStore next_store;
  Report last_report;
  // sleep. With nobody asleep `active` holds all bodies.
  Islands islands;
  // slots that the stages work on, ascending; slots woken in this sub-step
  Array<uint32_t> active, woken;
  Array<uint8_t> stirred;  // [island]

  explicit StepContext(const Meters &meters);
};

}  // namespace dfm
