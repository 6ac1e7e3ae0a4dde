// The world: its lasting state. step/step.cpp is the table of contents of a step; step/context.h has the
// buffers of a step.
#pragma once
#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "contact/store.h"
#include "core/memory.h"
#include "plan/plan.h"
#include "plugin/selection.h"
#include "state/attachment.h"
#include "state/body.h"
#include "state/energy_book.h"
#include "state/impulses.h"
#include "state/overlaps.h"
#include "state/pair_tables.h"
#include "state/step_sizes.h"
#include "state/world_bound.h"

namespace dfm {

class Background;
struct LawInstance;
struct Material;
struct Obstacle;
struct RigidSet;
struct StepContext;
struct Tool;

struct FrictionRule {
  std::string between[2];
  uint32_t law;
};
struct FilterRule {
  std::string between[2];
  bool collide;
};
// Two rigid things that touch, by ids. Side a is the one that gives way; where both or none do, the older.
struct RigidPair {
  uint64_t a, b;
  auto operator<=>(const RigidPair &) const = default;
};

// The work of a pair of ids, a body first, or of two rigid things as in RigidPair.
struct PairWork {
  uint64_t a, b;
  double friction;  // J, over the run
};

struct Gravity {
  std::vector<dfm_vector_key> keys;
  Vec3 now;  // m/s2
};

// Prescribed motions and loads during a search for an equilibrium.
struct Prescribed {
  double until = HUGE_VAL;  // s: keys and sines are constant from then on
  double share = 1;         // share of the constant loads
  double at(double t) const { return std::min(t, until); }
  bool is_static() const { return until < HUGE_VAL; }
};

// The host's answers about pairs (deform/callback.h), by ids: the body first, of two bodies the older one.
struct PairDecision {
  uint64_t a, b;
  bool touch;
};
struct MayTouch {
  dfm_may_touch_fn call = nullptr;
  void *user = nullptr;
  std::vector<PairDecision> decisions;  // sorted by (a, b)
};
struct PreSolve {
  dfm_pre_solve_fn call = nullptr;
  void *user = nullptr;
};

// Things that overlap a sensor, by ids; sorted by (sensor, thing).
struct Sensed {
  uint64_t sensor, thing;
  auto operator<=>(const Sensed &) const = default;
};

// Simulated time by integrator, where the library chooses implicit time; not in snapshots.
struct IntegratorTimes {
  double all = 0, implicit = 0;  // s
  uint64_t changes = 0;
  bool reported = false;         // a warning has said that bodies are implicit
  bool reported_impact = false;  // and one that a body did not rebound
};

// A measurement of creep (dfm_world_hold_begin).
struct Hold {
  bool on = false;
  double start = 0;  // s
};

// Number of events that are kept between steps. Beyond it many of the oldest are dropped at once, so that
// there is room for the next steps.
inline constexpr size_t kMaxEvents = 65536;
inline constexpr size_t kEventsAtOnce = 1024;
// Ids are below it: far more than any run makes, and far below an overflow.
inline constexpr uint64_t kMaxIds = uint64_t{1} << 48;

// What lasts of a world beside its bodies and obstacles. Snapshots have it.
struct WorldState {
  uint64_t next_id = 1;
  double time = 0;  // s
  uint64_t step_count = 0;
  StepSizes sizes;
  EnergyWatch watch;
  double impact_until = 0;  // s, until which bodies are explicit because of an impact; 0: none
  Hold hold;
  dfm_world_stats stats{};
  std::vector<FrictionRule> friction;
  std::vector<FilterRule> filters;
  std::vector<Attachment> attachments;  // by body, each in order of creation
  ContactStore store;
  ContactStore tool_store;  // of tools with each other and with rigid bodies (step/rigid/tool_touch.h)
  Array<RigidPair> rigid_touching;        // ascending; without a contact in tool_store: without load
  std::vector<PairWork> work;             // sorted by (a, b)
  std::vector<dfm_contact_event> events;  // a restore drops them
  std::vector<Swap> swaps;                // not yet read by the host; a restore drops them
  explicit WorldState(const Memory &contacts)
      : store(contacts), tool_store(contacts), rigid_touching(contacts) {}
};

// Memory of the parts of a world (dfm_world_memory). Each part allocates through its meter.
struct Meters {
  Meter bodies;     // points, cells, surfaces, couplings, data of models for each body
  Meter dynamics;   // dynamics of bodies: matrices and factors of implicit ones
  Meter obstacles;  // surfaces, voxels
  Meter detection;  // trees, lists of pairs
  Meter contacts;   // rows, states of laws, lasting contacts, reports
  Meter steps;      // other buffers of a step
  explicit Meters(const Memory &m)
      : bodies(m), dynamics(m), obstacles(m), detection(m), contacts(m), steps(m) {}
};

// Before everything that allocates through the meters.
struct WorldMemory {
  dfm_context *context;
  Meters meters;
};

// What a world consists of.
struct Entities {
  std::vector<std::unique_ptr<Body>> bodies;  // in id order
  // bodies without cells, which take no part in steps, in id order
  std::vector<std::unique_ptr<Body>> emptied;
  // pieces that a restore has removed; their handles are valid again when a piece gets the same id
  std::vector<std::unique_ptr<Body>> rolled_back;
  uint64_t shapes = 0;                               // number of the last shape that a cut has made
  std::vector<std::unique_ptr<Obstacle>> obstacles;  // in id order
  std::vector<std::unique_ptr<Material>> materials;
  // each holds the bodies of one host, which are also obstacles
  std::vector<std::unique_ptr<RigidSet>> rigid_sets;
  std::vector<std::unique_ptr<Tool>> tools;        // in order of creation; the parts of each are a set
  std::vector<std::unique_ptr<LawInstance>> laws;  // the first is the default law, made when first needed
  uint32_t sensors = 0;                            // how many there are
  uint32_t tearing = 0;                            // bodies that may tear

  // world.cpp
  Body *find_body(const std::string &name);
  Obstacle *find_obstacle(const std::string &name);
  // By id; nullptr: there is none, or no more.
  Body *body(uint64_t id) const;
  Obstacle *obstacle(uint64_t id) const;
  uint64_t handle_of(uint64_t id) const;  // body or obstacle; 0 if gone
};

// What the host has set for all of them.
struct Rules {
  dfm_world_def def{};
  Selection selection;            // by the list of effects
  std::vector<LeftOut> left_out;  // of the world itself
  ImplicitOptions implicit;       // of bodies whose integrator is implicit
  Gravity gravity;
  Prescribed prescribed;
  MayTouch may_touch;
  PreSolve pre_solve;
};

// Follows from the above and the lasting state: prepare() derives it whenever something changed.
struct Derived {
  bool changed = true;
  bool revalued = false;  // values_changed(): tables stay valid, the plan is checked
  Plan plan;
  PairTables pairs;
  double offset = 0;        // d_c, m
  uint64_t placements = 0;  // increases when positions or d_c change other than by a step
  uint32_t sleepers = 0;    // bodies that sleep
};

struct World : WorldMemory, WorldState, Entities, Rules, Derived {
  uint64_t handle = 0;
  std::vector<Sensed> sensed;  // at the end of the last step
  Overlaps overlaps;
  WorldBound bound;
  IntegratorTimes integrator_times;
  std::atomic<bool> busy{false};       // a call of the API changes it (api/call.h)
  std::unique_ptr<StepContext> steps;  // buffers: step/context.h
  StepImpulses step_impulses;
  std::unique_ptr<Background> background;  // null: nothing has been made beside the steps

  explicit World(dfm_context *c);
  ~World();
  const Memory &memory() const { return meters.bodies.memory(); }
};

}  // namespace dfm
