// Restores a snapshot. Everything is read and checked into a Staged before the world changes. Then the two
// are exchanged, which cannot fail; if the derived tables cannot be made, they are exchanged back.
#include <algorithm>
#include <cstring>

#include "body/make_surface.h"
#include "core/error.h"
#include "dynamics/rigid/rigid_set.h"
#include "friction/laws.h"
#include "plugin/context.h"
#include "plugin/params.h"
#include "state/world.h"
#include "step/stages.h"
#include "step/tool_touch.h"
#include "world/body_model.h"
#include "world/obstacle_change.h"
#include "world/snapshot.h"
#include "world/snapshot_cuts.h"
#include "world/snapshot_fields.h"
#include "world/snapshot_structure.h"
#include "world/snapshot_things.h"

namespace dfm {
namespace {

// Checks that it is complete, of this version and undamaged. Returns the hash that the world must have.
uint64_t check_head(const unsigned char *data, size_t bytes) {
  SnapshotHead head{};
  std::memcpy(&head, data, std::min(bytes, sizeof head));
  if (bytes < sizeof head.magic || std::memcmp(head.magic, kSnapshotMagic, sizeof head.magic - 1) != 0)
    fail(
        DFM_E_FORMAT,
        "these %zu bytes are not a snapshot, expected those of dfm_world_snapshot (Python: World.snapshot())",
        bytes);
  if (bytes < sizeof head)
    fail(DFM_E_FORMAT, "the snapshot is cut short: %zu bytes, the header alone has %zu; nothing was restored",
         bytes, sizeof head);
  if (head.magic[7] != 0 || head.version != kSnapshotVersion || head.zero != 0)
    fail(DFM_E_FORMAT,
         "the snapshot was written by another version of the library, or is damaged: this one reads format "
         "%u; nothing was restored",
         kSnapshotVersion);
  if (head.length != bytes)
    fail(DFM_E_FORMAT,
         "the snapshot is cut short or damaged: it says %llu bytes, and %zu were given; nothing was restored",
         static_cast<unsigned long long>(head.length), bytes);
  if (head.checksum != snapshot_checksum(data, bytes))
    fail(DFM_E_FORMAT, "the snapshot is damaged (checksum); nothing was restored");
  return head.structure;
}

// Laws are in the order in which the run first needed them, and contacts refer to them by this index.
std::vector<std::unique_ptr<LawInstance>> make_laws(const SnapshotReader &s, const World &w,
                                                    const Staged &t) {
  std::vector<std::unique_ptr<LawInstance>> laws;
  uint32_t most = 0;
  for (const StagedLaw &l : t.laws) {
    const dfm_type &type = w.context->registry.find(DFM_KIND_FRICTION, l.id);
    if (l.params.size() != packed_width(type))
      fail(DFM_E_FORMAT, "the snapshot was made with another version of law '%s'; nothing was restored",
           type.id);
    if (!snapshot::in_range(type, l.params))
      s.refuse("law parameters", "values in the range of the law's table");
    laws.push_back(std::make_unique<LawInstance>(type, w.context->host, l.params));
    laws.back()->restitution = l.restitution;
    for (const auto &own : w.laws)
      if (own->type == &type && own->params == l.params) {
        laws.back()->asked_type = own->asked_type;
        laws.back()->asked = own->asked;
      }
    most = std::max(most, laws.back()->nstate);
  }
  if (std::max(t.store.nstate, t.tool_store.nstate) > most)
    s.refuse("contact states", "no more than a law has");
  return laws;
}

// Makes the models that the world's bodies do not have, with the inputs in the snapshot.
void make_models(const SnapshotReader &s, World &w, Staged &t) {
  for (size_t i = 0; i < w.bodies.size(); ++i) {
    Body &b = *w.bodies[i];
    StagedBody &other = t.bodies[i];
    for (const Switch &x : other.switches) w.context->registry.find(DFM_KIND_MODEL, x.to.type);
    for (const SwitchRule &r : other.rule)
      for (const ModelChoice *c : {&r.touching, &r.near, &r.far})
        if (!c->type.empty()) w.context->registry.find(DFM_KIND_MODEL, c->type);
    if (!snapshot::made_alike(other, b)) {
      const dfm_type &type = w.context->registry.find(DFM_KIND_MODEL, other.model.id);
      try {
        other.made = make_body_model(w, b, type, other.origin, static_cast<int32_t>(other.integrator.used));
      } catch (const Error &e) {
        if (e.status == DFM_E_NOMEM) throw;
        fail(DFM_E_FORMAT, "the snapshot's model does not fit this world: %s; nothing was restored",
             e.what());
      }
      Integrator &moves = other.made->integrator;
      moves.chosen = other.integrator.chosen;
      moves.step = other.integrator.step;
      moves.share = other.integrator.share;
      std::swap(other.made->dampers, other.p.dampers);
      ModelInstance &made = other.made->instance;
      if (made.state.size() != other.model.state.size()) s.refuse("model state", "as many as the model has");
      if (made.params.size() != other.model.params.size() || !snapshot::in_range(type, other.model.params))
        s.refuse("model parameters", "values in the range of the model's table");
      made.state.swap(other.model.state);
    } else {
      // of a snapshot from before the choice, what is known of the body's own remains
      const Integrator &own = b.integrator;
      if (other.integrator.chosen == Chosen::no) {
        other.integrator.open = own.open;
        other.integrator.chosen = own.chosen == Chosen::struck ? Chosen::explicitly : own.chosen;
      }
    }
    const Dynamics &moves = other.made ? *other.made->dynamics : *b.dynamics;
    if (!other.springs.empty() && !moves.abilities().springs)
      s.refuse("spring number", "no spring on a body that steps itself");
  }
}

// ---- into the world ---------------------------------------------------------------------------------------

void put_parameters(const Body &b, ModelInstance &model, const Dynamics &moves,
                    const std::vector<double> &values) {
  if (values == model.params) return;
  if (model.put_params(values, moves.claims()) != DFM_OK)
    fail(DFM_E_FORMAT,
         "the snapshot has other parameters for model '%s' of body '%s', which cannot take them while it "
         "runs; nothing was restored",
         model.type->id, b.name.c_str());
}

// Restores the first `n` bodies.
void take_parameters_back(World &w, const Staged &t, size_t n) noexcept {
  while (n-- > 0) {
    Body &b = *w.bodies[n];
    if (!t.bodies[n].made && t.bodies[n].model.params != b.model.params)
      b.model.put_params(b.model.params, 0);
  }
}

// Sets all parameters of all models, or none.
void put_parameters(World &w, Staged &t) {
  for (size_t i = 0; i < w.bodies.size(); ++i)
    if (StagedBody &other = t.bodies[i]; other.made) {
      put_parameters(*w.bodies[i], other.made->instance, *other.made->dynamics, other.model.params);
      other.made->instance.params.swap(other.model.params);
    }
  size_t done = 0;
  try {
    for (; done < w.bodies.size(); ++done)
      if (!t.bodies[done].made)
        put_parameters(*w.bodies[done], w.bodies[done]->model, *w.bodies[done]->dynamics,
                       t.bodies[done].model.params);
  } catch (...) {
    take_parameters_back(w, t, done);
    throw;
  }
}

// Does not allocate; a second call undoes the first.
void exchange(World &w, Staged &t) noexcept {
  for (size_t i = 0; i < w.bodies.size(); ++i) {
    Body &b = *w.bodies[i];
    StagedBody &other = t.bodies[i];
    ++b.x_version;
    b.p.x.swap(other.p.x);
    b.p.v.swap(other.p.v);
    b.p.load.swap(other.p.load);
    b.p.held.swap(other.p.held);
    if (other.made) {
      exchange(b, *other.made);
    } else {
      b.model.state.swap(other.model.state);
      b.model.params.swap(other.model.params);
      std::swap(b.integrator.open, other.integrator.open);
      std::swap(b.integrator.chosen, other.integrator.chosen);
      std::swap(b.integrator.step, other.integrator.step);
      std::swap(b.integrator.share, other.integrator.share);
      std::swap(b.p.dampers, other.p.dampers);
    }
    b.switches.swap(other.switches);
    b.rule.swap(other.rule);
    std::swap(b.first_model, other.first_model);
    b.loads.swap(other.loads);
    b.springs.swap(other.springs);
    b.motions.swap(other.motions);
    std::swap(b.contact_impulse, other.contact_impulse);
    std::swap(b.energy, other.energy);
    std::swap(b.changes, other.changes);
    std::swap(b.next_load, other.next_load);
    std::swap(b.category, other.category);
    std::swap(b.collides_with, other.collides_with);
    std::swap(b.separate, other.separate);
    b.planned_cuts.swap(other.planned_cuts);
    b.blades.swap(other.blades);
    b.ahead.faces.swap(other.ahead.faces);
    b.ahead.later.swap(other.ahead.later);
    b.ahead.job.swap(other.ahead.job);
    std::swap(b.ahead.due, other.ahead.due);
    std::swap(b.slumber, other.slumber);
    b.bound.known = false;
    b.anchor.swap(other.anchor);
    if (!other.surfel_impulse.empty()) b.surfel_impulse.swap(other.surfel_impulse);
    if (b.slumber.asleep) gather_surface(b.surface, b.p.x.data(), b.p.v.data());
    update_inverse_mass(b.p);
  }
  for (size_t i = 0; i < w.obstacles.size(); ++i) {
    Obstacle &o = *w.obstacles[i];
    StagedObstacle &other = t.obstacles[i];
    if (!(o.rigid && o.rigid->njoint)) std::swap(o.def.pose, other.def.pose);
    std::swap(o.pose, other.pose);
    std::swap(o.target, other.target);
    std::swap(o.has_target, other.has_target);
    std::swap(o.def.sine, other.def.sine);
    o.keys.swap(other.keys);
    std::swap(o.def.velocity_surface, other.def.velocity_surface);
    std::swap(o.def.category, other.def.category);
    std::swap(o.def.collides_with, other.def.collides_with);
    o.zone.material.swap(other.zone.material);
    std::swap(o.zone.friction, other.zone.friction);
    o.material.swap(other.material);
    renew_defs(o);
  }
  for (size_t i = 0; i < w.rigid_sets.size(); ++i) {
    RigidSet &set = *w.rigid_sets[i];
    StagedRigids &other = t.rigid_sets[i];
    set.state.swap(other.state);
    set.extra.swap(other.extra);
    set.total.swap(other.total);
    std::swap(set.last_h, other.last_h);
  }
  for (size_t i = 0; i < w.tools.size(); ++i) std::swap(w.tools[i]->cuts, t.tools[i].cuts);
  w.friction.swap(t.friction);
  w.filters.swap(t.filters);
  w.attachments.swap(t.attachments);
  w.overlaps.aside.swap(t.overlaps.aside);
  w.gravity.keys.swap(t.gravity.keys);
  w.work.swap(t.work);
  w.events.swap(t.events);
  w.swaps.swap(t.swaps);
  std::swap(w.def.gravity, t.def.gravity);
  std::swap(w.def.sleep, t.def.sleep);
  std::swap(w.store, t.store);
  std::swap(w.tool_store, t.tool_store);
  std::swap(w.report, t.report);
  std::swap(w.rigid_report, t.rigid_report);
  std::swap(w.stats, t.stats);
  std::swap(w.time, t.time);
  std::swap(w.step_count, t.step_count);
  std::swap(w.next_id, t.next_id);
  std::swap(w.hold, t.hold);
  std::swap(w.sizes, t.sizes);
  std::swap(w.struck_until, t.struck_until);
  std::swap(w.watch, t.watch);
  w.bound.body = nullptr;
  w.bound.point = 0;
  ++w.placements;
}

}  // namespace

void world_restore(World &w, const void *data, size_t bytes) {
  const unsigned char *const p = static_cast<const unsigned char *>(data);
  const uint64_t structure = check_head(p, bytes);
  SnapshotReader s(p + sizeof(SnapshotHead), p + bytes);
  ThingRows things;
  thing_fields(s, things);
  SnapshotIds ids(w, things);
  if (structure != rest_of_structure(w))
    fail(DFM_E_FORMAT,
         "the snapshot belongs to another world: sets of rigid bodies, tools or self contact "
         "differ; create them as they were when it was taken; nothing was restored");
  std::vector<CutRow> cuts;
  cut_fields(s, cuts);
  SnapshotShapes shapes(w, cuts);
  Staged staged(w);
  snapshot::fields(s, staged, w);
  for (StagedObstacle &o : staged.obstacles) o.material = o.zone.material;
  for (size_t i = 0; i < w.tools.size(); ++i)
    if (Tool::Cuts &by = staged.tools[i].cuts; !by.bodies.empty())
      by.from.resize(w.tools[i]->motion.parts.size());  // the next step fills it in
  snapshot::check(s, staged, w);
  make_models(s, w, staged);
  // derived data, therefore recomputed and not read
  for (ContactStore *const store : {&staged.store, &staged.tool_store}) store->order();
  find_touching(w, staged.tool_store, staged.rigid_report.touching);
  std::vector<std::unique_ptr<LawInstance>> laws = make_laws(s, w, staged);
  const double offset = w.offset;
  const uint32_t sleepers = w.sleepers;
  put_parameters(w, staged);
  exchange(w, staged);
  w.laws.swap(laws);
  try {
    // Rebuilds tables and plan; choices that prepare() would make again are set to those of the snapshot.
    const RestoredChoice choice{staged.gravity.now, staged.bound, staged.offset};
    w.changed = true;
    w.overlaps.all = w.overlaps.look_only = true;
    w.sleepers = 0;  // prepare() counts them
    prepare(w, &choice);
  } catch (...) {
    // no memory for the tables: the state is unchanged, and the tables are made at the next use
    exchange(w, staged);
    take_parameters_back(w, staged, w.bodies.size());
    w.laws.swap(laws);
    w.offset = offset;
    w.sleepers = sleepers;
    throw;
  }
  shapes.keep();
  ids.keep();
}

}  // namespace dfm
