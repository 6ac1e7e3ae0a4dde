// Snapshot, restore and hash: everything that a later result depends on, and nothing else. Candidate lists are left out on purpose:
// contacts come from exact geometry, so lists that are built anew give the same contacts (broad/). What the host may change between two
// steps (loads, holds, motions, gravity, filters, friction rules, runtime parameters) is state too.
#include <cstring>

#include "core/error.h"
#include "core/hash.h"
#include "surfel/make_surface.h"
#include "world/measure.h"
#include "world/world.h"

namespace dfm {
namespace {

constexpr char kMagic[8] = {'d', 'f', 'm', 's', 'n', 'a', 'p', '6'};

void zone(Hash &h, const SurfaceZones::Zone &z) {
  h.add(z.group.data(), z.group.size()), h.add(z.material.data(), z.material.size()), h.add(z.friction);
}

// What must be the same in the world that a snapshot is restored into.
uint64_t structure(const World &w) {
  Hash h;
  for (auto &b : w.bodies) {
    h.add(b->id), h.add(b->p.n), h.add(b->surface.nsurfel), h.add(uint64_t(b->model.state.size()));
    h.add(b->model.type->id, std::strlen(b->model.type->id));
    h.add(b->name.data(), b->name.size()), h.add(b->material.data(), b->material.size());
    h.add(b->tets.data(), b->tets.size() * sizeof(uint32_t)), h.add(b->p.rest.data(), b->p.rest.size() * sizeof(double));
    h.add(b->p.mass.data(), b->p.mass.size() * sizeof(double));
    for (const CellField &f : b->fields) h.add(f.key.data(), f.key.size()), h.add(f.values.data(), f.values.size() * sizeof(double));
    const Surface &s = b->surface;
    h.add(s.row.data(), s.row.size() * sizeof(uint32_t)), h.add(s.col.data(), s.col.size() * sizeof(uint32_t));
    h.add(s.weight.data(), s.weight.size() * sizeof(double)), h.add(s.rest.data(), s.rest.size() * sizeof(double));
    if (!s.identity()) h.add(s.tri.data(), s.tri.size() * sizeof(uint32_t));
    zone(h, b->zones.list[0]);
    if (b->zones.of.empty()) continue;
    for (const auto &z : b->zones.list) zone(h, z);
    h.add(b->zones.of.data(), b->zones.of.size() * sizeof(uint32_t));
  }
  for (auto &o : w.obstacles) {
    const dfm_obstacle_def &d = o->def;
    h.add(o->id), h.add(d.shape), h.add(d.pose), h.add(d.half_size), h.add(d.radius), h.add(d.half_length), h.add(d.velocity_surface);
    if (!o->points.empty()) {
      h.add(o->points.data(), o->points.size() * sizeof(double)), h.add(o->triangles.data(), o->triangles.size() * sizeof(uint32_t));
      h.add(d.cells);
    }
    h.add(d.category), h.add(d.collides_with), h.add(o->name.data(), o->name.size()), h.add(o->material.data(), o->material.size());
    h.add(o->zone.friction);
    if (o->added) h.add(o->rigid_body), h.add(o->local.position), h.add(o->local.rotation);
  }
  for (auto &set : w.rigid_sets) {
    h.add(set->host_name.data(), set->host_name.size()), h.add(set->njoint), h.add(uint64_t(set->extra.size()));
    h.add(set->group.data(), set->group.size() * sizeof(uint32_t));
    for (const dfm_rigid_def &d : set->defs) h.add(d.mass), h.add(d.inertia);
  }
  if (w.def.method == DFM_METHOD_ROLLBACK) h.add(w.def.method);
  if (asks_self_contact(w)) h.add(uint8_t(1));
  return h.value;
}

// One list of fields serves writing and reading.
struct Writer {
  std::vector<unsigned char> &out;
  void bytes(const void *p, size_t n) { out.insert(out.end(), static_cast<const unsigned char *>(p), static_cast<const unsigned char *>(p) + n); }
  template <class T>
  void value(const T &x) { bytes(&x, sizeof x); }
  template <class A>
  void array(const A &a) { value(uint64_t(a.size())), bytes(a.data(), a.size() * sizeof(a[0])); }
  template <class A, class F>
  void each(const A &a, F f) {
    value(uint64_t(a.size()));
    for (const auto &x : a) f(x);
  }
};

struct Reader {
  const unsigned char *p, *end;
  void bytes(void *to, size_t n) {
    if (size_t(end - p) < n) fail(DFM_E_FORMAT, "snapshot is cut short: %zu bytes missing; nothing was restored", n - size_t(end - p));
    if (n) std::memcpy(to, p, n);
    p += n;
  }
  uint64_t count(size_t entry) {
    uint64_t n;
    value(n);
    if (n > uint64_t(end - p) / entry)
      fail(DFM_E_FORMAT, "snapshot is damaged: an array of %llu entries does not fit; nothing was restored", static_cast<unsigned long long>(n));
    return n;
  }
  template <class T>
  void value(T &x) { bytes(&x, sizeof x); }
  template <class A>
  void array(A &a) {
    a.resize(count(sizeof(a[0])));
    bytes(a.data(), a.size() * sizeof(a[0]));
  }
  template <class A, class F>
  void each(A &a, F f) {
    a.resize(count(1));
    for (auto &x : a) f(x);
  }
};

// A world's changing part, read in full before anything of it is put in place. Members are named as in World, Body and Obstacle, so that
// fields() below serves both.
struct StagedBody {
  struct { std::vector<double> x, v, load; std::vector<uint8_t> held; } p;
  struct { std::vector<double> state, params; } model;
  Vec3 contact_impulse;
  std::vector<Load> loads;
  std::vector<Spring> springs;
  std::vector<HeldMotion> motions;
  uint32_t next_load = 1, category = 1, collides_with = ~0u;
  Slumber slumber;
  std::vector<double> surfel_impulse, anchor, lagged;
};
struct StagedObstacle { Pose pose, target; bool has_target; std::vector<dfm_pose_key> keys; dfm_obstacle_def def; };
struct StagedRigids { std::vector<dfm_rigid_state> state; std::vector<double> extra, total; };
struct StagedLaw { std::string id; std::vector<double> params; };
struct Staged {
  double time, stable, offset, hold_start;
  uint64_t step_count, next_id;
  uint32_t inverted, sleepers;
  bool holding;
  uint32_t bound_age;
  StepSizes sizes;
  dfm_world_stats stats;
  Vec3 gravity;
  dfm_world_def def;
  std::vector<dfm_vector_key> gravity_keys;
  std::vector<StagedBody> bodies;
  std::vector<StagedObstacle> obstacles;
  std::vector<StagedRigids> rigid_sets;                // as many as the world has, before reading: `structure` vouches for them
  std::vector<StagedLaw> laws;
  std::vector<FrictionRule> friction;
  std::vector<FilterRule> filters;
  ContactStore store;
  std::vector<PairWork> work;
  Report report;
  explicit Staged(const Memory &m) : store(m) { use_memory(m, report.contacts, report.frame, report.impulse, report.slip, report.mode); }
};

template <class T>
auto &object(T &x) { return x; }
template <class T>
T &object(const std::unique_ptr<T> &x) { return *x; }

template <class Stream, class W>
void fields(Stream &s, W &w) {
  s.value(w.time), s.value(w.step_count), s.value(w.stable), s.value(w.inverted), s.value(w.bound_age), s.value(w.offset);
  for (auto *r : {&w.sizes.cut, &w.sizes.offer}) s.value(r->size), s.value(r->calm), s.value(r->patience);
  s.value(w.hold_start), s.value(w.holding);
  s.value(w.stats), s.value(w.gravity), s.value(w.def.gravity), s.value(w.next_id), s.array(w.gravity_keys);
  s.value(w.def.sleep), s.value(w.sleepers);
  s.each(w.bodies, [&](auto &entry) {
    auto &b = object(entry);
    s.array(b.p.x), s.array(b.p.v), s.array(b.p.held), s.array(b.p.load), s.array(b.model.state), s.array(b.model.params);
    s.value(b.contact_impulse), s.value(b.next_load), s.value(b.category), s.value(b.collides_with);
    s.each(b.loads, [&](auto &l) { s.value(l.number), s.array(l.points), s.array(l.force), s.array(l.keys), s.value(l.sine); });
    Slumber &z = b.slumber;
    s.value(z.asleep), s.value(z.calm), s.value(z.since), s.value(z.h), s.value(z.force);
    if (z.asleep) s.array(b.surfel_impulse);
    if (w.def.sleep) s.array(b.anchor);
    if (w.def.method == DFM_METHOD_ROLLBACK) s.array(b.lagged);
    s.each(b.springs, [&](auto &p) {
      s.value(p.number), s.array(p.points), s.array(p.weights), s.array(p.keys), s.value(p.to), s.value(p.stiffness), s.value(p.damping);
    });
    s.each(b.motions, [&](auto &m) { s.array(m.points), s.array(m.start), s.array(m.keys), s.value(m.sine); });
  });
  s.each(w.obstacles, [&](auto &entry) {
    auto &o = object(entry);
    s.value(o.pose), s.value(o.target), s.value(o.has_target), s.array(o.keys), s.value(o.def.sine);
  });
  for (auto &entry : w.rigid_sets) {
    auto &r = object(entry);
    s.array(r.state), s.array(r.extra), s.array(r.total);
  }
  auto rule = [&](auto &r) { s.array(r.between[0]), s.array(r.between[1]); };
  s.each(w.friction, [&](auto &r) { rule(r), s.value(r.law); });
  s.each(w.filters, [&](auto &r) { rule(r), s.value(r.collide); });
  auto &c = w.store;
  s.value(c.n), s.value(c.nstate), s.value(c.h);
  s.array(c.key), s.array(c.id_a), s.array(c.id_b), s.array(c.by_key), s.array(c.normal), s.array(c.tangent), s.array(c.impulse), s.array(c.bristle);
  s.array(c.law), s.array(c.dwell), s.array(c.area), s.array(c.due), s.array(c.path), s.array(c.touching), s.array(c.held), s.array(c.began);
  s.array(c.crossings);
  s.array(w.work);
  if (w.sleepers == 0) return;   // contacts that sleep are reported from what the last sub-step left
  auto &r = w.report;
  s.value(r.n), s.value(r.h), s.array(r.contacts), s.array(r.frame), s.array(r.impulse), s.array(r.slip), s.array(r.mode);
}

void write_laws(Writer &s, const World &w) {
  s.each(w.laws, [&](auto &l) { s.array(std::string(l->type->id)), s.array(l->params); });
}

// The checksum vouches for what was written, not for who wrote it: sizes are compared with the world all the same.
void check(const Staged &t, const World &w) {
  bool good = t.bodies.size() == w.bodies.size() && t.obstacles.size() == w.obstacles.size();
  for (size_t i = 0; good && i < t.bodies.size(); ++i) {
    const StagedBody &from = t.bodies[i];
    const Body &b = *w.bodies[i];
    good = from.p.x.size() == b.p.x.size() && from.p.v.size() == b.p.v.size() && from.p.held.size() == b.p.held.size() &&
           from.p.load.size() == b.p.load.size() && from.model.state.size() == b.model.state.size() &&
           from.model.params.size() == b.model.params.size();
    for (const Load &l : from.loads) {
      good = good && l.force.size() == 3 * l.points.size();
      for (uint32_t p : l.points) good = good && p < b.p.n;
    }
    for (const Spring &p : from.springs) {
      good = good && p.weights.size() == p.points.size();
      for (uint32_t at : p.points) good = good && at < b.p.n;
    }
    for (const HeldMotion &m : from.motions) {
      good = good && m.start.size() == 3 * m.points.size();
      for (uint32_t p : m.points) good = good && p < b.p.n;
    }
  }
  for (size_t i = 0; good && i < t.rigid_sets.size(); ++i) {
    const StagedRigids &from = t.rigid_sets[i];
    const RigidSet &set = *w.rigid_sets[i];
    good = from.state.size() == set.state.size() && from.extra.size() == set.extra.size() && from.total.size() == set.total.size();
  }
  const ContactStore &c = t.store;
  const size_t n = c.n;
  good = good && c.key.size() == n && c.id_a.size() == n && c.id_b.size() == n && c.by_key.size() == n && c.normal.size() == 3 * n &&
         c.tangent.size() == 3 * n && c.impulse.size() == 3 * n && c.bristle.size() == n * c.nstate && c.law.size() == n && c.dwell.size() == n &&
         c.area.size() == n && (c.due.empty() || c.due.size() == n) &&
         c.path.size() == 2 * n && c.touching.size() == n && c.held.size() == n && c.began.size() == n;
  good = good && c.crossings.size() <= n && std::is_sorted(c.crossings.begin(), c.crossings.end());
  for (uint32_t i : c.by_key) good = good && i < n;
  for (uint32_t l : c.law) good = good && l < t.laws.size();
  uint32_t sleepers = 0;
  for (size_t i = 0; good && i < t.bodies.size(); ++i) {
    const StagedBody &from = t.bodies[i];
    sleepers += from.slumber.asleep;
    good = (!from.slumber.asleep || from.surfel_impulse.size() == w.bodies[i]->surfel_impulse.size()) &&
           (!t.def.sleep || from.anchor.size() == w.bodies[i]->p.x.size()) && from.lagged.size() == w.bodies[i]->lagged.size();
  }
  good = good && sleepers == t.sleepers && t.def.sleep <= 1;
  if (const Report &r = t.report; sleepers > 0) {
    good = good && r.n == n && r.contacts.size() == n && r.frame.size() == 9 * n && r.impulse.size() == 3 * n && r.slip.size() == 2 * n && r.mode.size() == n;
    for (const ContactPoint &p : r.contacts)
      good = good && p.slot_a < w.bodies.size() && p.slot_b < (p.obstacle ? w.obstacles.size() : w.bodies.size());
  }
  for (const FrictionRule &r : t.friction) good = good && r.law < t.laws.size();
  good = good && sound(t.sizes);
  if (!good) fail(DFM_E_FORMAT, "the snapshot is damaged: its arrays do not fit this world; nothing was restored");
}

// Laws stand in the order in which the run first needed them, and contacts remember their law by that place.
std::vector<std::unique_ptr<LawInstance>> make_laws(const World &w, const Staged &t) {
  std::vector<std::unique_ptr<LawInstance>> laws;
  for (const StagedLaw &l : t.laws) {
    const dfm_type &type = w.context->registry.find(DFM_KIND_FRICTION, l.id);
    if (l.params.size() != packed_width(type)) fail(DFM_E_FORMAT, "the snapshot was made with another version of law '%s'; nothing was restored", type.id);
    laws.push_back(std::make_unique<LawInstance>(type, w.context->host, l.params));
  }
  return laws;
}

void put_parameters(Body &b, const std::vector<double> &values) {
  if (values == b.model.params) return;
  if (!b.model.ops->set_params || b.model.call("set_params", [&] { return b.model.ops->set_params(b.model.self, values.data()); }) != DFM_OK)
    fail(DFM_E_FORMAT, "the snapshot has other parameters for model '%s' of body '%s', which cannot take them while it runs; nothing was restored",
         b.model.type->id, b.name.c_str());
}

// All parameters of all models, or none.
void put_parameters(World &w, Staged &t) {
  size_t done = 0;
  try {
    for (; done < w.bodies.size(); ++done) put_parameters(*w.bodies[done], t.bodies[done].model.params);
  } catch (...) {
    while (done-- > 0) {
      Body &b = *w.bodies[done];
      if (t.bodies[done].model.params != b.model.params)
        b.model.call("set_params", [&] { return b.model.ops->set_params(b.model.self, b.model.params.data()); });
    }
    throw;
  }
  for (size_t i = 0; i < w.bodies.size(); ++i) w.bodies[i]->model.params.swap(t.bodies[i].model.params);
}

// Nothing in here allocates: arrays have the right size already, or change hands.
void put(World &w, Staged &t) noexcept {
  auto copy = [](const auto &from, auto &to) { std::copy(from.begin(), from.end(), to.begin()); };
  for (size_t i = 0; i < w.bodies.size(); ++i) {
    Body &b = *w.bodies[i];
    StagedBody &from = t.bodies[i];
    copy(from.p.x, b.p.x), copy(from.p.v, b.p.v), copy(from.p.held, b.p.held), copy(from.p.load, b.p.load), copy(from.model.state, b.model.state);
    b.loads.swap(from.loads), b.springs.swap(from.springs), b.motions.swap(from.motions);
    b.contact_impulse = from.contact_impulse, b.next_load = from.next_load, b.category = from.category, b.collides_with = from.collides_with;
    b.slumber = from.slumber, b.bound.known = false;
    if (t.def.sleep) copy(from.anchor, b.anchor);
    copy(from.lagged, b.lagged);
    if (b.slumber.asleep) copy(from.surfel_impulse, b.surfel_impulse), gather_surface(b.surface, b.p.x.data(), b.p.v.data());
    update_inverse_mass(b.p);
  }
  for (size_t i = 0; i < w.obstacles.size(); ++i) {
    Obstacle &o = *w.obstacles[i];
    StagedObstacle &from = t.obstacles[i];
    o.pose = from.pose, o.target = from.target, o.has_target = from.has_target, o.def.sine = from.def.sine;
    o.keys.swap(from.keys);
  }
  for (size_t i = 0; i < w.rigid_sets.size(); ++i) {
    RigidSet &set = *w.rigid_sets[i];
    copy(t.rigid_sets[i].state, set.state), copy(t.rigid_sets[i].extra, set.extra), copy(t.rigid_sets[i].total, set.total);
    set.last_h = 0;
  }
  w.friction.swap(t.friction), w.filters.swap(t.filters), w.gravity_keys.swap(t.gravity_keys), w.work.swap(t.work);
  std::copy(t.def.gravity, t.def.gravity + 3, w.def.gravity);
  std::swap(w.store, t.store);
  w.time = t.time, w.step_count = t.step_count, w.hold_start = t.hold_start, w.holding = t.holding, w.stats = t.stats, w.next_id = t.next_id;
  w.worst_body = nullptr, w.worst_point = 0;
  w.def.sleep = t.def.sleep, w.sleepers = 0;   // prepare() counts them
  std::swap(w.report, t.report);
  w.guard.forget();
  w.events.clear();
}

}  // namespace

uint64_t world_hash(const World &w) {
  Hash h;
  for (auto &b : w.bodies) {
    for (const Array<double> *a : {&b->p.x, &b->p.v, &b->model.state}) h.add(a->data(), a->size() * sizeof(double));
  }
  for (auto &set : w.rigid_sets) {
    h.add(set->state.data(), set->state.size() * sizeof(dfm_rigid_state)), h.add(set->extra.data(), set->extra.size() * sizeof(double));
  }
  const ContactStore &c = w.store;
  h.add(c.key.data(), c.key.size() * sizeof(uint64_t));
  h.add(c.bristle.data(), c.bristle.size() * sizeof(double));
  h.add(c.due.data(), c.due.size() * sizeof(double));
  for (auto &b : w.bodies) h.add(b->lagged.data(), b->lagged.size() * sizeof(double));
  if (w.def.sleep)
    for (auto &b : w.bodies) h.add(b->slumber.asleep), h.add(b->slumber.calm), h.add(b->slumber.since);
  return h.value;
}

void world_snapshot(const World &w, std::vector<unsigned char> &out) {
  Writer s{out};
  s.bytes(kMagic, sizeof kMagic);
  s.value(structure(w));
  write_laws(s, w);
  fields(s, w);
  Hash h;
  h.add(out.data(), out.size());
  s.value(h.value);
}

void world_restore(World &w, const void *data, size_t bytes) {
  const unsigned char *const p = static_cast<const unsigned char *>(data);
  if (bytes < sizeof kMagic + 16 || std::memcmp(p, kMagic, sizeof kMagic) != 0)
    fail(DFM_E_FORMAT, "these %zu bytes are no snapshot of this version; take one with dfm_world_snapshot", bytes);
  Hash h;
  h.add(p, bytes - sizeof(uint64_t));
  uint64_t sum;
  std::memcpy(&sum, p + bytes - sizeof sum, sizeof sum);
  if (sum != h.value) fail(DFM_E_FORMAT, "the snapshot is cut short or damaged (checksum); nothing was restored");
  Reader s{p + sizeof kMagic, p + bytes - sizeof sum};
  uint64_t shape;
  s.value(shape);
  if (shape != structure(w))
    fail(DFM_E_FORMAT,
         "the snapshot belongs to another world: names, meshes, masses, models, fields and obstacles must be the same; nothing was restored");
  Staged staged(w.memory());
  staged.rigid_sets.resize(w.rigid_sets.size());
  staged.def.method = w.def.method;
  s.each(staged.laws, [&](StagedLaw &l) { s.array(l.id), s.array(l.params); });
  fields(s, staged);
  check(staged, w);
  std::vector<std::unique_ptr<LawInstance>> laws = make_laws(w, staged);
  if (staged.def.sleep)
    for (auto &b : w.bodies) b->anchor.resize(b->p.x.size());
  put_parameters(w, staged);
  w.laws.swap(laws);
  put(w, staged);
  // Tables and plan follow from what is there now; what prepare() would choose anew is put back as it was.
  w.changed = true;
  w.prepare();
  w.gravity = staged.gravity, w.stable = staged.stable, w.inverted = staged.inverted, w.offset = staged.offset, w.bound_age = staged.bound_age;
  w.sizes = staged.sizes;
}

}  // namespace dfm
