// The world: what lasts. world/step.cpp is the table of contents of what happens to it in a step,
// world/context.h has the buffers of that.
#pragma once
#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "contact/store.h"
#include "deform/deform.h"
#include "dynamics/dynamics.h"
#include "friction/laws.h"
#include "plan/plan.h"
#include "plugin/context.h"
#include "plugin/params.h"
#include "surfel/obstacle_mesh.h"
#include "surfel/voxel_grid.h"
#include "surfel/zones.h"
#include "world/energy_book.h"
#include "world/impulses.h"
#include "world/motion.h"
#include "world/overlaps.h"
#include "world/pair_tables.h"
#include "world/report.h"
#include "world/rigid_set.h"
#include "world/search_tree.h"
#include "world/sleep.h"
#include "world/step_sizes.h"
#include "world/world_bound.h"

namespace dfm {

struct ContactMethod;
struct StepContext;
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
struct CellField {
  std::string key, from;
  uint32_t width;
  Array<double> values;
};

// A lasting load: force[i] on points[i], times the keyed scale, times 1 + sine.
struct Load {
  uint32_t number;
  std::vector<uint32_t> points;
  std::vector<double> force;
  std::vector<dfm_scale_key> keys;
  dfm_sine sine{};
};
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
struct HeldMotion {
  std::vector<uint32_t> points;
  std::vector<double> start;
  std::vector<dfm_pose_key> keys;
  dfm_sine sine{};
};

inline constexpr int32_t kNoCoupling = -1;
inline constexpr double kDefaultFriction = 0.5;  // of a material that has no entry "friction"

struct Body {
  World *world = nullptr;
  uint64_t id = 0, handle = 0;
  uint32_t slot = 0;
  std::string name, material;
  uint32_t category = 1, collides_with = ~0u;
  void *user = nullptr;

  Phyxels p;
  uint64_t x_version = 1;  // rises whenever p.x may have changed
  Array<uint32_t> tets, edges;
  Surface surface;
  SurfaceZones zones;
  int32_t coupling = kNoCoupling;  // DFM_COUPLING_* of a surface of its own
  ModelInstance model;
  std::unique_ptr<Dynamics> dynamics;  // how it moves
  double mass = 0, rest_volume = 0;
  Array<double> share;  // [ntet] how much of each cell is material; empty: all
  std::vector<CellField> fields;
  std::vector<Unused> unused;
  std::vector<Load> loads;
  std::vector<Spring> springs;
  std::vector<HeldMotion> motions;
  uint32_t next_load = 1;  // number of the next load or spring
  Vec3 contact_impulse;    // N s since creation
  EnergyBook energy;
  Array<double> surfel_impulse;  // [nsurfel,3] N s of the last sub-step
  // [n,4] what the contact method keeps of each point; empty where it keeps nothing
  Array<double> method_values;
  // as last asked for; holds while asleep
  struct {
    bool known = false;
    StepBound found;
    uint32_t inverted = 0;
  } bound;
  Slumber slumber;
  // [n,4] m, positions since which it is calm; empty where nothing may sleep
  Array<double> anchor;
  std::unique_ptr<SearchTree> search;  // rays and closest points

  bool loads_vary() const;
  double impulse_time() const;  // s that surfel_impulse belongs to
};

struct Obstacle {
  World *world = nullptr;
  uint64_t id = 0, handle = 0;
  uint32_t slot = 0;
  std::string name, material;
  SurfaceZones::Zone zone{"", "", kDefaultFriction};
  dfm_obstacle_def def{};
  std::vector<dfm_pose_key> keys;
  Pose pose;    // now
  Pose target;  // at the end of the next step, where move_to set it
  bool has_target = false;
  RigidSet *rigid = nullptr;  // a body of a rigid host: where it stands in `rigid`
  uint32_t rigid_body = 0;
  bool added = false;  // a further shape of that body, at `local` in its frame
  Pose local;
  bool moves() const {
    return !keys.empty() || def.sine.amplitude[0] != 0 || def.sine.amplitude[1] != 0 ||
           def.sine.amplitude[2] != 0;
  }
  Array<double> points;  // mesh, voxels: as given, in its frame
  Array<uint32_t> triangles;
  std::unique_ptr<ObstacleMesh> mesh;
  std::unique_ptr<VoxelGrid> grid;
  std::unique_ptr<SearchTree> search;  // rays
  Pose pose_at_time(double t) const;
  // of a sub-step, in a step that lasts for `left` from t
  Pose end_pose(double t, double h, double left) const;
};

struct FrictionRule {
  std::string between[2];
  uint32_t law;
};
struct FilterRule {
  std::string between[2];
  bool collide;
};
struct PairWork {
  uint64_t a, b;
  double work;
};

struct Gravity {
  std::vector<dfm_vector_key> keys;
  Vec3 now;  // m/s2
};

// A measurement of what creeps (dfm_world_hold_begin).
struct Hold {
  bool on = false;
  double start = 0;  // s
};

// between steps; with more, so many of the oldest go that
inline constexpr size_t kMostEvents = 65536;
inline constexpr size_t kEventsAtOnce = 1024;  // the next steps find room

struct World {
  dfm_context *context;
  uint64_t handle = 0;
  dfm_world_def def{};
  std::vector<std::string> asked_effects;
  Gravity gravity;

  std::vector<std::unique_ptr<Body>> bodies;         // in id order
  std::vector<std::unique_ptr<Obstacle>> obstacles;  // in id order
  std::vector<std::unique_ptr<Material>> materials;
  std::vector<std::unique_ptr<RigidSet>> rigid_sets;  // each a host's bodies, which are obstacles too
  std::vector<std::unique_ptr<LawInstance>> laws;     // the first is the default law, made when first needed
  std::vector<FrictionRule> friction;
  std::vector<FilterRule> filters;
  Overlaps overlaps;
  // rises when positions or d_c change otherwise than by a step
  uint64_t placements = 0;
  uint64_t next_id = 1;

  // Derived from the above by prepare() whenever something changed.
  bool changed = true;
  bool revalued = false;  // values_changed(): tables hold, the plan is looked at
  Plan plan;
  PairTables pairs;
  double offset = 0;                      // d_c, m
  const ContactMethod *method = nullptr;  // its table of stages, and what it cannot do (world/method.h)

  // Time.
  double time = 0;  // s
  uint64_t step_count = 0;
  WorldBound bound;
  StepSizes sizes;
  EnergyWatch watch;
  std::atomic<bool> busy{false};  // a call of the API changes it (api/call.h)

  std::unique_ptr<StepContext> steps;  // buffers: world/context.h

  ContactStore store;
  Report report;
  std::vector<PairWork> work;  // sorted by (a, b)
  std::vector<dfm_contact_event> events;
  StepImpulses step_impulses;
  Hold hold;
  uint32_t sleepers = 0;

  dfm_world_stats stats{};

  explicit World(dfm_context *c);
  ~World();
  const Memory &memory() const { return context->memory; }

  // world.cpp
  Body *find_body(const std::string &name);
  Obstacle *find_obstacle(const std::string &name);
  uint64_t handle_of(uint64_t id) const;  // body or obstacle; 0 if gone
};

}  // namespace dfm
