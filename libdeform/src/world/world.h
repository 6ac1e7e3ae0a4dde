// The world: what it holds, and the buffers of a step. world/step.cpp is the table of contents of what happens to it.
#pragma once
#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "broad/broad_phase.h"
#include "contact/areas.h"
#include "contact/exchange.h"
#include "contact/renewal.h"
#include "contact/solver.h"
#include "contact/store.h"
#include "deform/deform.h"
#include "distribute/distribute.h"
#include "friction/laws.h"
#include "model/model.h"
#include "phyxel/phyxels.h"
#include "plan/plan.h"
#include "plugin/context.h"
#include "plugin/params.h"
#include "surfel/obstacle_mesh.h"
#include "surfel/views.h"
#include "surfel/voxel_grid.h"
#include "surfel/zones.h"
#include "world/budget.h"
#include "world/energy_watch.h"
#include "world/guard.h"
#include "world/islands.h"
#include "world/motion.h"
#include "world/overlap.h"
#include "world/rigid.h"
#include "world/rollback.h"
#include "world/self_contact.h"
#include "world/sleep.h"
#include "world/snapshot.h"
#include "world/step_impulses.h"
#include "world/step_sizes.h"

namespace dfm {

struct World;

struct Material {
  uint64_t handle = 0;
  World *world = nullptr;
  std::string name;
  dfm_material_def def{};
  std::vector<std::string> extra_keys;
  std::vector<std::vector<double>> extra_values;
};

// A model parameter that differs from cell to cell, and who said so ("field", "materials", "share").
// An entry of a material that the body's model has no parameter for.
struct Unused { std::string key, material; };
struct CellField { std::string key, from; uint32_t width; Array<double> values; };

// A lasting load: force[i] on points[i], times the keyed scale, times 1 + sine.
struct Load { uint32_t number; std::vector<uint32_t> points; std::vector<double> force; std::vector<dfm_scale_key> keys; dfm_sine sine{}; };
// A spring of rest length zero from the weighted mean of points to a place, or a path of places.
struct Spring {
  uint32_t number;
  std::vector<uint32_t> points;
  std::vector<double> weights;
  std::vector<dfm_vector_key> keys;
  Vec3 to;
  double stiffness, damping;
};
// Held points carried by keyed poses (relative to the first key) and a sine.
struct HeldMotion { std::vector<uint32_t> points; std::vector<double> start; std::vector<dfm_pose_key> keys; dfm_sine sine{}; };

inline constexpr int32_t kNoCoupling = -1;
inline constexpr double kDefaultFriction = 0.5;        // of a material that has no entry "friction"

struct Body {
  World *world = nullptr;
  uint64_t id = 0, handle = 0;
  uint32_t slot = 0;
  std::string name, material;
  uint32_t category = 1, collides_with = ~0u;
  void *user = nullptr;

  Phyxels p;
  Array<uint32_t> tets, edges;
  Surface surface;
  SurfaceZones zones;
  int32_t coupling = kNoCoupling;    // DFM_COUPLING_* of a surface of its own
  ModelInstance model;
  double mass = 0, rest_volume = 0;
  Array<double> share;               // [ntet] how much of each cell is material; empty: all
  std::vector<CellField> fields;
  std::vector<Unused> unused;
  std::vector<Load> loads;
  std::vector<Spring> springs;
  std::vector<HeldMotion> motions;
  uint32_t next_load = 1;            // number of the next load or spring
  Vec3 contact_impulse;              // N s since creation
  EnergyBook energy;
  Array<double> surfel_impulse;      // [nsurfel,3] N s of the last sub-step
  Array<double> lagged;              // [n,4] N, friction for the next sub-step; empty where the method is not rollback
  Array<double> ksum, csum;          // [n] row sums of the step bound
  struct { bool known = false; double step = 0; uint32_t point = 0, inverted = 0; } bound;   // as last asked for; holds while asleep
  Slumber slumber;
  Array<double> anchor;              // [n,4] m, positions since which it is calm; empty where nothing may sleep

  bool loads_vary() const;
  double impulse_time() const;       // s that surfel_impulse belongs to
  dfm_kin kin(double t, double h, double *state_out) const;
};

struct Obstacle {
  World *world = nullptr;
  uint64_t id = 0, handle = 0;
  uint32_t slot = 0;
  std::string name, material;
  SurfaceZones::Zone zone{"", "", kDefaultFriction};
  dfm_obstacle_def def{};
  std::vector<dfm_pose_key> keys;
  Pose pose;                         // now
  Pose target;                       // at the end of the next step, where move_to set it
  bool has_target = false;
  RigidSet *rigid = nullptr;         // a body of a rigid host: where it stands in `rigid`
  uint32_t rigid_body = 0;
  bool added = false;                // a further shape of that body, at `local` in its frame
  Pose local;
  bool moves() const { return !keys.empty() || def.sine.amplitude[0] != 0 || def.sine.amplitude[1] != 0 || def.sine.amplitude[2] != 0; }
  Array<double> points;              // mesh, voxels: as given, in its frame
  Array<uint32_t> triangles;
  std::unique_ptr<ObstacleMesh> mesh;
  std::unique_ptr<VoxelGrid> grid;
  Pose pose_at_time(double t) const;
  Pose end_pose(double t, double h, double left) const;   // of a sub-step, in a step that lasts for `left` from t
};

struct FrictionRule { std::string between[2]; uint32_t law; };
struct FilterRule { std::string between[2]; bool collide; };
struct PairWork { uint64_t a, b; double work; };

// What the last sub-step left for the report: contacts in key order with their solution.
struct Report {
  uint32_t n = 0;
  double h = 0;
  Array<ContactPoint> contacts;
  Array<double> frame, impulse, slip;   // [n,9], [n,3], [n,2]
  Array<uint8_t> mode;
};

inline constexpr size_t kMostEvents = 65536;           // between steps; with more, so many of the oldest go that
inline constexpr size_t kEventsAtOnce = 1024;          // the next steps find room

struct World {
  dfm_context *context;
  uint64_t handle = 0;
  dfm_world_def def{};
  std::vector<std::string> asked_effects;
  std::vector<dfm_vector_key> gravity_keys;

  std::vector<std::unique_ptr<Body>> bodies;           // in id order
  std::vector<std::unique_ptr<Obstacle>> obstacles;    // in id order
  std::vector<std::unique_ptr<Material>> materials;
  std::vector<std::unique_ptr<RigidSet>> rigid_sets;   // each a host's bodies, which are obstacles too
  std::vector<std::unique_ptr<LawInstance>> laws;      // the first is the default law, made when first needed
  std::vector<FrictionRule> friction;
  std::vector<FilterRule> filters;
  Overlaps overlaps;
  uint64_t next_id = 1;

  // Derived from the above by prepare() whenever something changed.
  bool changed = true;
  Plan plan;
  std::vector<uint32_t> pair_law;                      // [body][body or obstacle] -> index into laws
  std::vector<uint32_t> zone_table, zone_law;          // as pair_law -> first in zone_law [zone a][zone b], kNone: the pair has one law; empty: all have
  PairFilter filter;
  std::vector<LawInstance *> law_list;
  double offset = 0;                                   // d_c, m
  uint32_t bound_age = kNone;                          // sub-steps since the bound was asked for; kNone: ask before the next step

  // Time.
  double time = 0, stable = 0;                         // s; stable: 0.9 of the bound at its last evaluation
  StepSizes sizes;
  EnergyWatch watch;
  Array<double> free_kinetic;                           // [bodies] J, without contact; of this sub-step
  uint64_t step_count = 0;
  Body *worst_body = nullptr;
  uint32_t inverted = 0;                               // cells inside out at the last evaluation of the bound
  uint32_t worst_point = 0;
  std::atomic<bool> busy{false};                       // a call of the API changes it (api/call.h)

  // Buffers of a sub-step.
  std::vector<BodyView> body_views;
  std::vector<ObstacleView> obstacle_views;
  std::vector<RigidPlace> rigid_places;                // by obstacle slot; empty without rigid bodies
  std::vector<uint32_t> rigid_groups;                  // bodies per group, all sets
  bool rigid_again = false;                            // a host has answered, and the solve goes on from its last impulses
  std::vector<DofSource> sources;
  std::vector<ImpulseSink> sinks;
  BroadPhase broad;
  std::vector<std::unique_ptr<SelfBody>> self_bodies;  // in id order; those that may touch themselves
  Array<ContactPoint> contacts;
  Array<uint8_t> lent;                                 // scratch of the narrow phase
  ContactRows rows;
  ContactState state;
  Acceleration acceleration;
  Tolerance tolerance;
  Array<double> disturbance, best_impulse;
  ContactStore store, next_store;
  LawBatches batches;
  AreaShares areas;
  AreaExchange exchange;
  Array<uint32_t> sharing;                             // law of contacts whose areas follow the load, else kNone
  bool shares = false;                                 // does any law count by area?
  Array<double> aim;                                   // [contacts] m2, what they should stand for, if so
  Renewal renewal;
  Array<uint8_t> stands;                               // [contacts] carries, and has an area that it keeps
  Array<Renewal::Way> ways;
  Array<double> renewed;
  Array<double> tangents;
  Array<uint32_t> match;
  Array<uint32_t> block_surfels;                       // scratch of self-stepping bodies
  Array<double> block_impulse, block_velocity;
  struct Driven { double *velocity, before; };
  Array<Driven> driven;                                // held components that this sub-step's motion stage has set
  Vec3 gravity;
  double h = 0, left = 0;                              // s: of the sub-step; from its start to the end of the step
  Budget budget;
  Guard guard;
  Rollback rollback;
  Residual residual;
  uint32_t passes = 0, sweeps = 0;

  Report report, last_report;                          // last_report: scratch
  std::vector<PairWork> work;                          // sorted by (a, b)
  std::vector<dfm_contact_event> events;
  StepImpulses step_impulses;
  double hold_start = 0;
  bool holding = false;

  // Sleep. With nobody asleep `active` holds all bodies.
  Islands islands;
  Array<uint32_t> active, woken;                       // slots that the stages work on, ascending; slots woken in this sub-step
  Array<uint8_t> stirred;                              // [island] scratch
  uint32_t sleepers = 0;

  dfm_world_stats stats{};
  std::array<double, 24> stage_seconds{};
  std::array<uint64_t, 24> stage_calls{};

  explicit World(dfm_context *c);
  const Memory &memory() const { return context->memory; }

  // world.cpp
  void prepare(const RestoredChoice *restored = nullptr);   // plan, pair tables, offset; throws Error
  Body *find_body(const std::string &name);
  Obstacle *find_obstacle(const std::string &name);
  uint64_t handle_of(uint64_t id) const;               // body or obstacle; 0 if gone
  // Index of the law with these values: one that is there, else a new one, in a place that `free` marks or behind the others.
  uint32_t add_law(const char *name, std::span<const dfm_param_value> values, std::span<const uint8_t> free = {});

  // pair_table.cpp; a, b: bodies by slot, then obstacles
  uint32_t law_of(uint32_t slot_a, bool obstacle, uint32_t slot_b) const;
  uint32_t resolve_law(uint32_t a, uint32_t zone_a, uint32_t b, uint32_t zone_b);
  void find_law(uint32_t a, uint32_t b, std::vector<uint32_t> &used);   // fills pair_law and, where zones differ, the tables; used: laws out
  void set_zone_laws();                                // state.law of this sub-step's contacts where a pair has a table

  // step.cpp
  dfm_status step(double dt, uint32_t *trouble);
  bool sub_step(uint32_t *trouble);
  bool advance(double end, double goal, bool last, uint32_t *trouble);
  bool piece(uint32_t *trouble);                       // sub_step(), shorter where the guard asks for it
  void undo_motion();                                  // held velocities as before stage_motion()
  void update_bound();                                 // stable, worst_body, worst_point
  bool bound_due() const;                              // does the next step ask for it?
  void ask_bound(Body &b);

  // stages of a sub-step, each in the file of its name
  void stage_motion();
  bool stage_model(uint32_t *trouble);
  bool stage_predict(uint32_t *trouble);
  bool stage_rigid_predict(uint32_t *trouble);         // rigid.cpp
  bool stage_rigid_commit(uint32_t *trouble);          // rigid.cpp: ends beside the present states, kept by keep_rigids()
  bool ask_rigids(uint32_t *trouble);                  // rigid.cpp
  int ask_rigid_ends(uint32_t *trouble);               // rigid.cpp
  void keep_rigids();                                  // rigid.cpp: once the sub-step is known to succeed
  void stage_gather();
  void stage_broad();
  bool stage_narrow(uint32_t *trouble);                // sleep.cpp
  void stage_self();                                   // self_contact.cpp
  bool stage_solve(uint32_t *trouble);                 // solve.cpp
  void make_rows();                                    // solve.cpp: contacts as rows, with what they kept
  uint32_t tell_failed_solve(const LawInstance *law);  // failed_solve.cpp: to dfm_last_error(), null: not finite; which trouble that is
  void stage_lagged();                                 // rollback.cpp
  bool stage_rollback(uint32_t *trouble);              // rollback.cpp
  const LawInstance *solve_rows();
  void stage_distribute();
  bool stage_guard(uint32_t *trouble);                 // guard.cpp
  bool stage_commit(uint32_t *trouble);
  bool commit_steppers(uint32_t *trouble);
  void stage_sleep();                                  // sleep.cpp, as are the next ones
  void gather_active();
  void reserve_sleep(uint32_t n);                      // waking and falling asleep allocate nothing, and cannot fail
  void wake(Body &b);                                  // and its island
  void wake_all();
  void wake_touching(uint64_t obstacle);
  void rouse(std::span<const uint32_t> slots);
  void fall_asleep(Body &b, double end);
  bool idle() const;
  void carry_sleepers(uint32_t *touching, uint32_t *sticking);
  bool sleeps(uint32_t m) const;
  void close_slot(uint64_t id, bool obstacle);
  void hold_sleepers();                                // hold_begin() while contacts sleep
  void reserve_events(size_t more);
  void add_event(uint32_t kind, uint64_t a, uint64_t b, uint64_t key, double t);   // a, b: ids
  void reserve_contacts();                             // solve.cpp: memory for keep_contacts()
  void keep_contacts();
  void list_crossings();                                // solve.cpp: store, events, hold, work; allocates nothing
};

}  // namespace dfm
