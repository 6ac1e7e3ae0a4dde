// The contents of a snapshot, read in full before the world changes (snapshot_restore.cpp).
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "friction/laws.h"
#include "state/tool.h"
#include "state/world.h"
#include "world/body_model.h"

namespace dfm {

// Members have the names of those in World, Body and Obstacle, so that the lists of fields work for both.
struct StagedBody {
  struct {
    Array<double> x, v, load;
    Array<uint8_t> held;
  } p;
  struct {
    std::string id;
    Array<double> state;
    std::vector<double> params;
  } model;
  ModelOrigin origin;
  Integrator integrator;
  std::vector<Switch> switches;
  std::vector<SwitchRule> rule;
  uint64_t first_model = 0;
  std::unique_ptr<BodyModel> made;  // if the body has another model than in the snapshot
  Vec3 contact_impulse;
  EnergyBook energy;
  ChangeBook changes;
  std::vector<Load> loads;
  std::vector<Spring> springs;
  std::vector<HeldMotion> motions;
  uint32_t next_load = 1, category = 1, collides_with = ~0u;
  SeparateRule separate;
  std::vector<PlannedCut> planned_cuts;
  std::vector<BladeTrack> blades;
  CutsAhead ahead;
  Slumber slumber;
  Array<double> surfel_impulse, anchor, method_values;
};
struct StagedObstacle {
  Pose pose, target;
  bool has_target = false;
  std::vector<dfm_pose_key> keys;
  dfm_obstacle_def def{};
  std::string material;
  struct {
    std::string material;
    double friction = kDefaultFriction;
  } zone;
};
struct StagedRigids {
  Array<dfm_rigid_state> state;
  Array<double> extra, total;
  double last_h = 0;
};
struct StagedTool { Tool::Cuts cuts; };
struct StagedLaw {
  std::string id;
  std::vector<double> params;
  double restitution = kNoRestitution;
};
struct Staged {
  double time = 0, offset = 0;
  uint64_t step_count = 0, next_id = 0;
  uint32_t sleepers = 0;
  WorldBound bound;
  Hold hold;
  StepSizes sizes;
  EnergyWatch watch;
  double struck_until = 0;
  dfm_world_stats stats{};
  Gravity gravity;
  dfm_world_def def{};
  std::vector<StagedBody> bodies;
  std::vector<StagedObstacle> obstacles;
  std::vector<StagedRigids> rigid_sets;
  std::vector<StagedTool> tools;
  std::vector<StagedLaw> laws;
  std::vector<FrictionRule> friction;
  std::vector<FilterRule> filters;
  std::vector<Attachment> attachments;
  ContactStore store, tool_store;
  struct { std::vector<PairAside> aside; } overlaps;
  std::vector<PairWork> work;
  Report report;
  RigidReport rigid_report;               // pairs that touch alone
  std::vector<dfm_contact_event> events;  // none
  std::vector<Swap> swaps;                // none
  explicit Staged(const World &w)
      : store(w.meters.contacts.memory()),
        tool_store(w.meters.contacts.memory()),
        report(w.meters.contacts.memory()),
        rigid_report(w.meters.contacts.memory()) {
    const Memory &m = w.memory();
    def.method = w.def.method;
    bodies.resize(w.bodies.size());
    obstacles.resize(w.obstacles.size());
    rigid_sets.resize(w.rigid_sets.size());
    tools.resize(w.tools.size());
    for (StagedBody &b : bodies)
      use_memory(m, b.p.x, b.p.v, b.p.load, b.p.held, b.model.state, b.surfel_impulse, b.anchor,
                 b.method_values);
    for (StagedRigids &r : rigid_sets) use_memory(m, r.state, r.extra, r.total);
  }
};

}  // namespace dfm
