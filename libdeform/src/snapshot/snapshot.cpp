// Writes and restores a snapshot. A restore reads and checks everything into a Staged before the world
// changes. Then the two are exchanged, which cannot fail; if the derived tables cannot be made, they are
// exchanged back.
#include <algorithm>
#include <array>
#include <cstring>

#include "body/make_surface.h"
#include "body/obstacle_mesh.h"
#include "core/error.h"
#include "core/hash.h"
#include "dynamics/rigid/rigid_set.h"
#include "friction/laws.h"
#include "plugin/context.h"
#include "plugin/params.h"
#include "snapshot/snapshot.h"
#include "snapshot/snapshot_cuts.h"
#include "snapshot/snapshot_fields.h"
#include "snapshot/snapshot_structure.h"
#include "snapshot/snapshot_things.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/rigid/tool_touch.h"
#include "step/step_impulses.h"
#include "step/stages.h"
#include "world/body_model.h"
#include "world/obstacle_change.h"

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
  for (const StagedLaw &l : t.laws) {
    const auto type_of = [&](const std::string &id, const std::vector<double> &params) -> const dfm_type & {
      const dfm_type &type = w.context->registry.find(DFM_KIND_FRICTION, id);
      if (params.size() != packed_width(type))
        fail(DFM_E_FORMAT, "the snapshot was made with another version of law '%s'; nothing was restored",
             type.id);
      if (!snapshot::fits(type, params)) s.refuse("law parameters", "values in the range of the law's table");
      return type;
    };
    laws.push_back(std::make_unique<LawInstance>(type_of(l.id, l.params), w.context->host, l.params));
    laws.back()->restitution = l.restitution;
    laws.back()->requested_type = &type_of(l.requested_id, l.requested);
    laws.back()->requested = l.requested;
  }
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
      ModelInstance &made = other.made->model;
      if (made.state.size() != other.model.state.size()) s.refuse("model state", "as many as the model has");
      std::vector<double> &requested = other.switched_off.requested;
      if (!snapshot::fits(type, other.model.params) ||
          (!requested.empty() && !snapshot::fits(type, requested)))
        s.refuse("model parameters", "values in the range of the model's table");
      other.made->switched_off.requested.swap(requested);
      made.state.swap(other.model.state);
    } else {
      // of a snapshot from before the choice, what is known of the body's own remains
      const Integrator &own = b.integrator;
      other.integrator.point = own.point;
      if (other.integrator.chosen == Chosen::no) {
        other.integrator.open = own.open;
        other.integrator.chosen = own.chosen == Chosen::in_impact ? Chosen::explicitly : own.chosen;
      }
    }
    const Dynamics &moves = other.made ? *other.made->dynamics : *b.dynamics;
    if (!other.springs.empty() && !moves.abilities().springs)
      s.refuse("spring number", "no spring on a body that steps itself");
  }
}

// ---- conditions between fields ----------------------------------------------------------------------

// Bodies of the world that is restored into; both lists are in id order.
struct Things {
  const World &w;
  const Body *body(uint64_t id) const { return w.body(id); }
  const Obstacle *obstacle(uint64_t id) const { return w.obstacle(id); }
  bool known(uint64_t id) const { return body(id) || obstacle(id); }
  // Whether a feature of a body may have this number.
  bool feature(uint64_t id, uint8_t type, uint32_t number) const {
    const Body *const b = body(id);
    return !b || number < (type == 0 ? b->surface.nsurfel : type == 1 ? b->surface.nedge : b->surface.ntri);
  }
  // Whether an edge may have this number. Edge numbers of primitives are only compared and index nothing.
  bool edge(uint64_t id, uint32_t number) const {
    if (const Body *const b = body(id)) return number < b->surface.nedge;
    const Obstacle *const o = obstacle(id);
    return o && (!o->mesh || number < o->mesh->surface.nedge);
  }
};

// Whether contact i has directions that are not longer than unit vectors.
bool good_frame(const ContactStore &c, uint32_t i) {
  return std::ranges::all_of(std::array{&c.normal, &c.tangent, &c.turned},
                             [i](auto *of) { return norm2(load3(&(*of)[3 * size_t{i}])) < 1.01; });
}

bool good_contacts(const Staged &t, const Things &things) {
  const ContactStore &c = t.store;
  if (c.n > 0 && !(c.h > 0)) return false;
  if (!c.next_area.empty() && c.next_area.size() != c.n) return false;
  for (uint32_t i = 0; i < c.n; ++i) {
    if (!good_frame(c, i)) return false;
    if (!things.feature(c.id_a[i], c.type_a[i], c.feature_a[i]) ||
        !things.feature(c.id_b[i], c.type_b[i], c.feature_b[i]))
      return false;
    // Contacts of removed things remain until the next sub-step, without touching.
    if (c.id_a[i] >= t.next_id || c.id_b[i] >= t.next_id ||
        (c.touching[i] && !(things.body(c.id_a[i]) && things.known(c.id_b[i]))))
      return false;
  }
  if (c.crossings.size() > c.n || !std::is_sorted(c.crossings.begin(), c.crossings.end())) return false;
  for (const Crossing &x : c.crossings)
    if (things.known(x.id_a) && things.known(x.id_b) &&
        !(things.edge(x.id_a, x.edge_a) && things.edge(x.id_b, x.edge_b)))
      return false;
  return true;
}

bool good_tool_contacts(const Staged &t, const Things &things) {
  const ContactStore &c = t.tool_store;
  if ((c.n > 0 && !(c.h > 0)) || !c.next_area.empty() || !c.crossings.empty()) return false;
  for (uint32_t i = 0; i < c.n; ++i) {
    if (!good_frame(c, i) || !c.touching[i] || !things.obstacle(c.id_a[i]) || !things.obstacle(c.id_b[i]))
      return false;
  }
  return true;
}

bool good_work(const std::vector<PairWork> &work, const Things &things) {
  for (size_t i = 0; i < work.size(); ++i)
    if (!things.known(work[i].a) || !things.known(work[i].b) ||
        (i && !(std::pair(work[i - 1].a, work[i - 1].b) < std::pair(work[i].a, work[i].b))))
      return false;
  return true;
}

bool valid_suspended(const std::vector<SuspendedPair> &pairs, const Things &things) {
  return std::all_of(pairs.begin(), pairs.end(), [&](const SuspendedPair &p) {
    return things.body(p.a) && (p.obstacle ? things.obstacle(p.b) != nullptr : things.body(p.b) != nullptr);
  });
}

bool good_attachments(const std::vector<Attachment> &list, const Things &things) {
  return std::all_of(list.begin(), list.end(), [&](const Attachment &a) {
    const Body *const b = things.body(a.body), *const to = a.obstacle ? nullptr : things.body(a.to);
    if (!b || b == to || !(a.obstacle ? things.obstacle(a.to) != nullptr : to != nullptr)) return false;
    return !a.surfels.empty() && snapshot::below(a.surfels, b->surface.nsurfel) &&
           (!to || snapshot::below(a.node, to->surface.nsurfel));
  });
}

// Throws Error if one is not met.
void check(const SnapshotReader &s, const Staged &t, const World &w) {
  if (!s.at_end()) s.refuse("the end", "no bytes after the last field");
  if (!good_contacts(t, {w})) s.refuse("contacts", "contacts of bodies and obstacles that are there");
  if (!good_tool_contacts(t, {w})) s.refuse("contacts of tools", "contacts that tools can have");
  if (!good_work(t.work, {w})) s.refuse("friction work", "pairs that are there, in order");
  if (!valid_suspended(t.overlaps.suspended, {w}))
    s.refuse("pairs that are set aside", "bodies and obstacles that are there");
  if (!good_attachments(t.attachments, {w})) s.refuse("attachments", "surfels of bodies that are there");
  size_t sleepers = 0;
  for (const StagedBody &b : t.bodies) sleepers += b.sleep_state.asleep;
  if (sleepers != t.sleepers) s.refuse("sleepers", "as many as sleep");
  for (size_t i = 0; i < t.rigid_sets.size(); ++i) {
    const RigidSet &set = *w.rigid_sets[i];
    for (size_t k = 0; k < set.group.size(); ++k)
      if (set.group[k] == DFM_RIGID_STILL &&
          std::memcmp(&t.rigid_sets[i].state[k], &set.state[k], sizeof(dfm_rigid_state)) != 0)
        s.refuse("rigid state", "a fixed body where it stands");
  }
}

// ---- into the world ---------------------------------------------------------------------------------------

void put_parameters(const Body &b, ModelInstance &model, const Dynamics &moves,
                    const std::vector<double> &values) {
  if (values == model.params) return;
  if (model.put_params(values, moves.abilities().claims) != DFM_OK)
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
      put_parameters(*w.bodies[i], other.made->model, *other.made->dynamics, other.model.params);
      other.made->model.params.swap(other.model.params);
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
      b.switched_off.requested.swap(other.switched_off.requested);
      std::swap(b.integrator, other.integrator);
      std::swap(b.p.dampers, other.p.dampers);
    }
    std::swap<BodyState>(b, other);
    std::swap<OnPoints>(b, other);
    b.ahead.faces.swap(other.ahead.faces);
    b.ahead.later.swap(other.ahead.later);
    b.ahead.job.swap(other.ahead.job);
    std::swap(b.ahead.open_time, other.ahead.open_time);
    b.bound.known = false;
    b.surfel_impulse.swap(other.surfel_impulse);
    if (b.sleep_state.asleep) gather_surface(b.surface, b.p.x.data(), b.p.v.data());
    update_inverse_mass(b.p);
  }
  for (size_t i = 0; i < w.obstacles.size(); ++i) {
    Obstacle &o = *w.obstacles[i];
    StagedObstacle &other = t.obstacles[i];
    if (!(o.rigid && o.rigid->njoint)) std::swap(o.def.pose, other.def.pose);
    std::swap<ObstacleState>(o, other);
    std::swap(o.def.sine, other.def.sine);
    std::swap(o.def.velocity_surface, other.def.velocity_surface);
    std::swap(o.def.category, other.def.category);
    std::swap(o.def.collides_with, other.def.collides_with);
    renew_defs(o);
  }
  for (size_t i = 0; i < w.rigid_sets.size(); ++i) {
    RigidSet &set = *w.rigid_sets[i];
    StagedRigids &other = t.rigid_sets[i];
    set.state.swap(other.state);
    set.extra.swap(other.extra);
    set.motors.swap(other.motors);
    set.total.swap(other.total);
    set.wrench.swap(other.wrench);
  }
  for (size_t i = 0; i < w.tools.size(); ++i) std::swap(w.tools[i]->cuts, t.tools[i].cuts);
  std::swap<WorldState>(w, t);
  w.overlaps.suspended.swap(t.overlaps.suspended);
  w.gravity.keys.swap(t.gravity.keys);
  std::swap(w.def.gravity, t.def.gravity);
  std::swap(w.def.sleep, t.def.sleep);
  w.bound.body = nullptr;
  w.bound.point = 0;
  ++w.placements;
}

}  // namespace

uint64_t world_hash(const World &w) {
  Hash h;
  for (auto &b : w.bodies) h.list(b->p.x, b->p.v, b->p.dampers.v, b->p.dampers.slow, b->model.state);
  for (auto &set : w.rigid_sets) h.list(set->state, set->extra);
  for (const ContactStore *const store : {&w.store, &w.tool_store})
    each_column(
        [&](const ContactColumn &column, const auto &values) {
          if (column.hashed) h.list(values);
        },
        *store);
  if (w.def.sleep)
    for (auto &b : w.bodies) {
      h.add(b->sleep_state.asleep);
      h.add(b->sleep_state.quiet_time);
      h.add(b->sleep_state.since);
    }
  // where it is another one than at the first step: until then it follows from how the world was made
  for (auto &b : w.bodies)
    if (const uint64_t model = model_hash(*b); model != b->first_model) {
      h.add(b->id);
      h.add(model);
    }
  return h.value;
}

void world_snapshot(const World &w, std::vector<unsigned char> &out) {
  out.resize(sizeof(SnapshotHead));
  SnapshotWriter s(out);
  const ThingRows things = thing_rows(w);
  thing_fields(s, things);
  const std::vector<CutRow> cuts = cut_rows(w);
  cut_fields(s, cuts);
  snapshot::fields(s, w, w);
  SnapshotHead head{{}, kSnapshotVersion, 0, out.size(), rest_of_structure(w), 0};
  std::memcpy(head.magic, kSnapshotMagic, sizeof head.magic);
  std::memcpy(out.data(), &head, sizeof head);
  head.checksum = snapshot_checksum(out.data(), out.size());
  std::memcpy(out.data(), &head, sizeof head);
}

void world_restore(World &w, const void *data, size_t bytes) {
  const unsigned char *const p = static_cast<const unsigned char *>(data);
  const uint64_t structure = check_head(p, bytes);
  SnapshotReader s(p + sizeof(SnapshotHead), p + bytes);
  end_idle(w);
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
  check(s, staged, w);
  make_models(s, w, staged);
  // derived data, therefore recomputed and not read
  for (ContactStore *const store : {&staged.store, &staged.tool_store}) store->order();
  find_touching(w, staged.tool_store, staged.rigid_touching);
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
    const Overlaps::Mode mode(w.overlaps, &Overlaps::report_only);
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
