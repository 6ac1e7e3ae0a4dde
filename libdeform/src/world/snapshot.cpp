// Snapshot, restore and hash of everything that later results depend on, and nothing else. Candidate lists
// are not included: contacts come from exact geometry, so rebuilt lists give the same contacts (broad/). What
// the host may change between two steps (loads, holds, motions, gravity, filters, friction rules, runtime
// parameters) is state too.
//
// A field is one line in one of the ..._fields() functions below: its name, its location and its valid
// values. Writing, reading and checking use this line; conditions between fields are in check(). A restore
// reads and checks everything into a Staged before it changes anything, then exchanges it with the world,
// which cannot fail; if the derived tables cannot be made, it exchanges back.
#include "world/snapshot.h"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "body/make_surface.h"
#include "core/error.h"
#include "core/hash.h"
#include "plugin/params.h"
#include "state/world.h"
#include "step/context.h"
#include "step/method.h"
#include "step/stages.h"
#include "world/body_model.h"
#include "world/measure.h"
#include "world/obstacle_change.h"
#include "world/snapshot_cuts.h"
#include "world/snapshot_models.h"
#include "world/snapshot_staged.h"
#include "world/snapshot_stream.h"
#include "world/snapshot_structure.h"

namespace dfm {
namespace {

template <class T>
auto &object(T &x) {
  return x;
}
template <class T>
T &object(const std::unique_ptr<T> &x) {
  return *x;
}

std::string id_of(const LawInstance &law) { return law.type->id; }
std::string &id_of(StagedLaw &law) { return law.id; }
std::string id_of(const ModelInstance &model) { return model.type->id; }
std::string &id_of(decltype(StagedBody::model) &model) { return model.id; }

// ---- valid values ----------------------------------------------------------------------------------

template <class Key>
bool rise(const std::vector<Key> &keys) {
  try {
    check_keys(keys, "");
    return true;
  } catch (const Error &) {
    return false;
  }
}

// Vectors are four doubles apart, and detection relies on a fourth that is zero.
template <class A>
bool padded(const A &a) {
  for (size_t i = 3; i < a.size(); i += kStride)
    if (a[i] != 0) return false;
  return true;
}

template <class List>
bool below(const List &list, uint32_t n) {
  return std::all_of(list.begin(), list.end(), [n](uint32_t i) { return i < n; });
}

bool in_range(const dfm_type &type, const std::vector<double> &values) {
  std::vector<dfm_param_value> given;
  size_t at = 0;
  for (uint32_t i = 0; i < type.nparam; at += type.params[i++].width)
    given.push_back({type.params[i].key, values.data() + at, type.params[i].width});
  try {
    pack_params(type, given);
    return true;
  } catch (const Error &) {
    return false;
  }
}

bool good_state(const dfm_rigid_state &s) {
  return must::all_finite(s.position) && must::all_finite(s.velocity) && must::all_finite(s.spin) &&
         must::rotation.is(s.rotation);
}

bool good_stats(const dfm_world_stats &s) {
  return s.size == sizeof s && must::all_finite(s.time) && must::all_finite(s.residual) &&
         must::all_finite(s.contacts_mean) && must::all_finite(s.residual_max) && s.stable_step >= 0 &&
         must::all_finite(s.sleep_energy) && must::all_finite(s.sleep_momentum) &&
         must::all_finite(s.guard_lost);
}

// far more than any run makes, and far below an overflow
constexpr uint64_t kMostIds = uint64_t{1} << 48;
uint64_t last_id(const World &w) {
  uint64_t last = w.obstacles.empty() ? 0 : w.obstacles.back()->id;
  for (const auto *list : {&w.bodies, &w.emptied})
    if (!list->empty()) last = std::max(last, list->back()->id);
  return last;
}

// A destroyed material remains in the bodies made of it.
bool knows_material(const World &w, const std::string &name) {
  return std::any_of(w.materials.begin(), w.materials.end(), [&](auto &m) { return m->name == name; }) ||
         std::any_of(w.obstacles.begin(), w.obstacles.end(), [&](auto &o) { return o->material == name; });
}

// s; no bound of a body in SI units is smaller, and a smaller one would stop the world
constexpr double kLeastStep = 1e-15;

// ---- the fields -------------------------------------------------------------------------------------------

// `like`: the world that is written, or restored into.
template <class Stream, class B>
void prescribed_fields(Stream &s, B &b, const Body &like) {
  s.value("next_load", b.next_load, must::any);
  const auto sine = [&](auto &x) { s.value("sine", x, must::finite); };
  s.list("loads", b.loads, [&](auto &l) {
    s.value("load number", l.number, must::any);
    s.array("load points", l.points, kAnyCount, must::below(like.p.n));
    s.array("load force", l.force, 3 * l.points.size(), must::finite);
    s.array("load keys", l.keys, kAnyCount, must::any);
    sine(l.sine);
    s.must_hold("load keys", "finite keys at rising times", [&] { return rise(l.keys); });
    s.must_hold("load number", "a number below the next one", [&] { return l.number < b.next_load; });
  });
  s.list("springs", b.springs, [&](auto &p) {
    s.value("spring number", p.number, must::any);
    s.array("spring points", p.points, kAnyCount, must::below(like.p.n));
    s.array("spring weights", p.weights, p.points.size(), must::not_negative);
    s.array("spring keys", p.keys, kAnyCount, must::any);
    s.value("spring end", p.to, must::finite);
    s.value("spring stiffness", p.stiffness, must::not_negative);
    s.value("spring damping", p.damping, must::not_negative);
    s.must_hold("spring keys", "finite keys at rising times", [&] { return rise(p.keys); });
    s.must_hold("spring number", "a number below the next one", [&] { return p.number < b.next_load; });
    s.must_hold("spring weights", "weights that sum to one", [&] {
      return std::fabs(std::accumulate(p.weights.begin(), p.weights.end(), 0.0) - 1) < 1e-9;
    });
  });
  s.list("motions", b.motions, [&](auto &m) {
    s.array("motion points", m.points, kAnyCount, must::below(like.p.n));
    s.array("motion start", m.start, 3 * m.points.size(), must::finite);
    s.array("motion keys", m.keys, kAnyCount, must::any);
    sine(m.sine);
    s.must_hold("motion keys", "finite keys at rising times", [&] { return rise(m.keys); });
  });
}

// Whether the body has the same model, with the same inputs, as in the snapshot.
template <class B>
bool made_alike(B &b, const Body &like) {
  const ModelOrigin &mine = b.origin, &other = like.origin;
  const auto bits = [](const Pose &a, const Pose &c) { return std::memcmp(&a, &c, sizeof a) == 0; };
  return id_of(b.model) == like.model.type->id && mine.params == other.params &&
         bits(mine.frame, other.frame) && mine.integrator == other.integrator && mine.held == other.held &&
         b.integrator.used == like.integrator.used;
}

template <class Stream, class B>
void model_fields(Stream &s, B &b, const Body &like) {
  s.array("model", id_of(b.model), kAnyCount, must::any);
  param_fields(s, b.origin.params);
  s.value("model's frame", b.origin.frame, must::pose);
  s.value("model's integrator", b.origin.integrator, must::at_most(DFM_INTEGRATOR_TR_BDF2));
  s.array("model's held", b.origin.held, like.origin.held.size(), must::at_most(7));
  s.value("integrator used", b.integrator.used,
          must::Be{[](uint32_t x) { return x - 1 < DFM_INTEGRATOR_TR_BDF2; }, "an integrator"});
  s.value("integrator by count", b.integrator.counted,
          must::Be{[](Counted x) { return x <= Counted::explicitly; }, "no, implicit or explicit"});
  s.value("explicit sub-step", b.integrator.step,
          must::Be{[](double x) { return x > 0; }, "a time above zero"});
  const bool alike = made_alike(b, like);
  s.array("model state", b.model.state, alike ? like.model.state.size() : kAnyCount, must::finite);
  s.array("model parameters", b.model.params, alike ? like.model.params.size() : kAnyCount, must::finite);
  s.must_hold("model parameters", "values in the range of the model's table",
              [&] { return !alike || in_range(*like.model.type, b.model.params); });
  s.value("first model", b.first_model, must::any);
  switch_fields(s, b);
}

template <class Stream, class W, class B>
void body_fields(Stream &s, W &w, B &b, const Body &like) {
  s.where("body", like.name);
  s.array("position", b.p.x, like.p.x.size(), must::finite);
  s.array("velocity", b.p.v, like.p.v.size(), must::finite);
  s.array("held", b.p.held, like.p.held.size(), must::at_most(7));
  s.array("load sum", b.p.load, like.p.load.size(), must::finite);
  s.must_hold("position", "a fourth component of zero",
              [&] { return padded(b.p.x) && padded(b.p.v) && padded(b.p.load); });
  model_fields(s, b, like);
  s.value("contact_impulse", b.contact_impulse, must::finite);
  s.value("energy known", b.energy.known, must::at_most(8));
  s.value("least energy", b.energy.base, must::finite);
  s.value("booked work", b.energy.work, must::finite);
  s.value("kinetic energy", b.energy.kinetic, must::finite);
  s.must_hold("energy known", "what the energy watch writes", [&] { return sound(b.energy); });
  s.value("model has changed", b.changes.open, must::flag);
  s.value("refusal told", b.changes.told, must::flag);
  s.value("largest energy", b.changes.largest, must::not_negative);
  for (auto *x : {&b.changes.unpaid, &b.changes.level, &b.changes.work})
    s.value("energy of changes", *x, must::finite);
  s.value("category", b.category, must::any);
  s.value("collides_with", b.collides_with, must::any);
  s.list("blades", b.blades, [&](auto &blade) {
    for (auto &x : blade.edge) s.value("blade's edge", x, must::finite);
    s.array("points at a blade", blade.x, like.p.x.size(), must::finite);
    s.value("blade's way of late", blade.lead, must::finite);
    for (auto &way : blade.way) s.value("blade's way", way, must::finite);
    s.array("sides of a blade", blade.sides, kAnyCount, must::any);
    s.must_hold("sides of a blade", "those of cells", [&] { return sound(blade.sides, like.tets.size()); });
  });
  s.value("separates", b.separate.on, must::flag);
  s.value("crumbs go", b.separate.removes, must::flag);
  s.value("fewest cells of a piece", b.separate.least, must::any);
  s.value("asleep", b.slumber.asleep, must::flag);
  s.value("calm", b.slumber.calm, must::not_negative);
  s.value("asleep since", b.slumber.since, must::not_negative);
  s.value("sub-step asleep", b.slumber.h, must::not_negative);
  s.value("force asleep", b.slumber.force, must::finite);
  s.must_hold("asleep", "a sleep that began in a sub-step before now, where bodies may sleep", [&] {
    return !b.slumber.asleep || (w.def.sleep && b.slumber.since <= w.time && b.slumber.h > 0);
  });
  if (b.slumber.asleep) s.array("surfel impulse", b.surfel_impulse, like.surfel_impulse.size(), must::finite);
  if (w.def.sleep) s.array("anchor", b.anchor, like.p.x.size(), must::finite);
  if (const char *const name = like.world->method->point_values)
    s.array(name, b.method_values, like.method_values.size(), must::finite);
  prescribed_fields(s, b, like);
  s.where("", "");
}

template <class Stream, class C>
void contact_fields(Stream &s, C &c, uint64_t laws) {
  s.value("contacts", c.n, must::any);
  s.value("contact states", c.nstate, must::any);
  s.value("contact sub-step", c.h, must::not_negative);
  const uint64_t n = c.n;
  each_column(
      [&](auto column, auto &values) {
        using V = ColumnValues;
        constexpr V kind = decltype(column)::values;
        const uint64_t count = column.width == kOwnLength ? kAnyCount : column.entries(n, c.nstate);
        if (!column.name) return;
        if constexpr (kind == V::finite) s.array(column.name, values, count, must::finite);
        else if constexpr (kind == V::not_negative) s.array(column.name, values, count, must::not_negative);
        else if constexpr (kind == V::flag) s.array(column.name, values, count, must::flag);
        else if constexpr (kind == V::law) s.array(column.name, values, count, must::below(laws));
        else s.array(column.name, values, count, must::any);
      },
      c);
}

template <class Stream, class W>
void rule_fields(Stream &s, W &w, uint64_t laws) {
  const auto between = [&](auto &r) {
    s.array("rule", r.between[0], kAnyCount, must::any);
    s.array("rule", r.between[1], kAnyCount, must::any);
    s.must_hold("rule", "two names", [&] { return !r.between[0].empty() && !r.between[1].empty(); });
  };
  s.list("friction rules", w.friction, [&](auto &r) {
    between(r);
    s.value("rule's law", r.law, must::below(laws));
  });
  s.array("pairs that are set aside", w.overlaps.aside, kAnyCount,
          must::Be{[](const PairAside &x) { return x.obstacle <= 1 && x.a != x.b; }, "two things"});
  s.list("filter rules", w.filters, [&](auto &r) {
    between(r);
    s.value("collide", r.collide, must::flag);
  });
}

template <class Stream, class W>
void attachment_fields(Stream &s, W &w) {
  s.list("attachments", w.attachments, [&](auto &a) {
    s.value("attachment number", a.number, must::any);
    s.value("attached body", a.body, must::any);
    s.value("attached to", a.to, must::any);
    s.value("attached to an obstacle", a.obstacle, must::flag);
    s.value("attachment flags", a.flags, must::at_most(DFM_ATTACH_TOUCH));
    for (auto *x : {&a.stiffness, &a.damping, &a.release, &a.h})
      s.value("attachment values", *x, must::not_negative);
    s.array("attached surfels", a.surfels, kAnyCount, must::any);
    const uint64_t n = a.surfels.size(), anchors = a.obstacle ? 0 : kAnchors * n;
    s.array("attached places", a.place, a.obstacle ? 3 * n : 0, must::finite);
    s.array("attached nodes", a.node, anchors, must::any);
    s.array("attached weights", a.weight, anchors, must::finite);
    s.array("attachment impulse", a.impulse, 3 * n, must::finite);
    s.value("attachment total", a.total, must::finite);
    s.value("attachment released", a.released, must::flag);
  });
}

template <class Stream, class W>
void fields(Stream &s, W &w, const World &like) {
  s.list("laws", w.laws, [&](auto &entry) {
    auto &l = object(entry);
    s.array("law", id_of(l), kAnyCount, must::any);
    s.must_hold("law", "the name of a law", [&] { return !id_of(l).empty(); });
    s.array("law parameters", l.params, kAnyCount, must::finite);
  });
  s.value("time", w.time, must::not_negative);
  s.value("steps", w.step_count, must::any);
  s.value("step bound", w.bound.step, must::Be{[](double x) { return x >= 0; }, "a time above zero"});
  s.value("inverted cells", w.bound.inverted, must::any);
  s.value("age of the bound", w.bound.age, must::any);
  s.value("strain since the bound", w.bound.strain, must::not_negative);
  s.must_hold("step bound", "a time that a sub-step can have",
              [&] { return w.bound.age == kNone || w.bound.step >= kLeastStep; });
  for (auto *r : {&w.sizes.cut, &w.sizes.offer}) {
    s.value("step size", r->size, must::not_negative);
    s.value("calm of the size", r->calm, must::any);
    s.value("patience", r->patience, must::any);
  }
  s.value("accurate step", w.sizes.accurate, must::not_negative);
  s.value("work put by", w.purse,
          must::Be{[](const IntegratorPurse &x) { return sound(x); }, "a finite sum"});
  s.must_hold("step size", "sizes that the library chooses", [&] { return sound(w.sizes); });
  s.value("age of the energies", w.watch.age, must::any);
  s.value("credit of the energies", w.watch.credit, must::any);
  s.value("last sub-step", w.watch.last_h, must::not_negative);
  s.must_hold("last sub-step", "what the energy watch writes", [&] { return sound(w.watch); });
  s.value("contact offset", w.offset, must::positive);
  s.value("hold start", w.hold.start, must::finite);
  s.value("holding", w.hold.on, must::flag);
  s.value("statistics", w.stats,
          must::Be{[](const dfm_world_stats &x) { return good_stats(x); }, "finite statistics"});
  s.value("gravity", w.gravity.now, must::finite);
  s.value("gravity", w.def.gravity, must::finite);
  s.value("next id", w.next_id,
          must::Be{[&](uint64_t x) { return x > last_id(like) && x < kMostIds; },
                   "a number above all that are taken"});
  s.array("gravity keys", w.gravity.keys, kAnyCount, must::any);
  s.must_hold("gravity keys", "finite keys at rising times", [&] { return rise(w.gravity.keys); });
  s.value("sleep", w.def.sleep, must::flag);
  s.value("sleepers", w.sleepers, must::any);
  s.must_hold("sleep", "no sleep with this contact method",
              [&] { return !w.def.sleep || !lacks(*like.method, Ability::sleep); });
  size_t at = 0;
  s.members("bodies", w.bodies, like.bodies.size(),
            [&](auto &entry) { body_fields(s, w, object(entry), *like.bodies[at++]); });
  at = 0;
  s.members("obstacles", w.obstacles, like.obstacles.size(), [&](auto &entry) {
    auto &o = object(entry);
    s.where("obstacle", like.obstacles[at++]->name);
    s.value("pose", o.pose, must::pose);
    s.value("target", o.target, must::pose);
    s.value("has a target", o.has_target, must::flag);
    s.array("keys", o.keys, kAnyCount, must::any);
    s.value("sine", o.def.sine, must::finite);
    s.must_hold("keys", "finite keys at rising times", [&] { return rise(o.keys); });
    s.value("velocity_surface", o.def.velocity_surface, must::finite);
    s.value("category", o.def.category, must::any);
    s.value("collides_with", o.def.collides_with, must::any);
    s.array("material", o.zone.material, kAnyCount, must::any);
    s.value("material's friction", o.zone.friction, must::not_negative);
    s.must_hold("material", "a material of this world",
                [&] { return o.zone.material.empty() || knows_material(like, o.zone.material); });
  });
  at = 0;
  s.members("sets of rigid bodies", w.rigid_sets, like.rigid_sets.size(), [&](auto &entry) {
    auto &r = object(entry);
    const RigidSet &l = *like.rigid_sets[at++];
    s.where("rigid body", l.defs[0].name);
    s.array("rigid state", r.state, l.state.size(),
            must::Be{[](const dfm_rigid_state &x) { return good_state(x); },
                     "finite states and unit quaternions"});
    s.array("host's values", r.extra, l.extra.size(), must::finite);
    s.array("impulse", r.total, l.total.size(), must::finite);
  });
  s.where("", "");
  attachment_fields(s, w);
  rule_fields(s, w, w.laws.size());
  contact_fields(s, w.store, w.laws.size());
  s.array("friction work", w.work, kAnyCount,
          must::Be{[](const PairWork &x) { return sound(x); }, "finite work, rises not below zero"});
  if (w.sleepers == 0) return;  // contacts that sleep are reported from what the last sub-step left
  auto &r = w.report;
  const uint64_t n = w.store.n;
  s.value("reported contacts", r.n, must::at_most(n));
  s.value("reported sub-step", r.h, must::positive);
  s.array("report", r.contacts, n, must::any);
  s.array("reported frame", r.frame, 9 * n, must::finite);
  s.array("reported impulse", r.impulse, 3 * n, must::finite);
  s.array("reported slip", r.slip, 2 * n, must::finite);
  s.array("reported mode", r.mode, n, must::at_most(2));
}

// ---- conditions between fields ------------------------------------------------------------------------

// Bodies of the world that is restored into; both lists are in id order.
struct Things {
  const World &w;
  const Body *body(uint64_t id) const { return find(w.bodies, id); }
  const Obstacle *obstacle(uint64_t id) const { return find(w.obstacles, id); }
  bool known(uint64_t id) const { return body(id) || obstacle(id); }
  template <class List>
  static auto find(const List &list, uint64_t id) -> decltype(list[0].get()) {
    const auto at = std::lower_bound(list.begin(), list.end(), id,
                                     [](const auto &x, uint64_t value) { return x->id < value; });
    return at != list.end() && (*at)->id == id ? at->get() : nullptr;
  }
  // Whether an edge may have this number. Edge numbers of primitives are only compared and index nothing.
  bool edge(uint64_t id, uint32_t number) const {
    if (const Body *const b = body(id)) return number < b->surface.nedge;
    const Obstacle *const o = obstacle(id);
    return o && (!o->mesh || number < o->mesh->surface.nedge);
  }
};

bool good_contacts(const Staged &t, const Things &things) {
  const ContactStore &c = t.store;
  if (c.n > 0 && !(c.h > 0)) return false;
  if (!c.due.empty() && c.due.size() != c.n) return false;
  for (uint32_t i = 0; i < c.n; ++i) {
    const Vec3 n = load3(&c.normal[3 * size_t{i}]), u = load3(&c.tangent[3 * size_t{i}]);
    if (!(norm2(n) < 1.01 && norm2(u) < 1.01)) return false;
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

bool good_work(const std::vector<PairWork> &work, const Things &things) {
  for (size_t i = 0; i < work.size(); ++i)
    if (!things.body(work[i].a) || !things.known(work[i].b) ||
        (i && !(std::pair(work[i - 1].a, work[i - 1].b) < std::pair(work[i].a, work[i].b))))
      return false;
  return true;
}

bool good_aside(const std::vector<PairAside> &pairs, const Things &things) {
  return std::all_of(pairs.begin(), pairs.end(), [&](const PairAside &p) {
    return things.body(p.a) && (p.obstacle ? things.obstacle(p.b) != nullptr : things.body(p.b) != nullptr);
  });
}

bool good_attachments(const std::vector<Attachment> &list, const Things &things) {
  return std::all_of(list.begin(), list.end(), [&](const Attachment &a) {
    const Body *const b = things.body(a.body), *const to = a.obstacle ? nullptr : things.body(a.to);
    if (!b || b == to || !(a.obstacle ? things.obstacle(a.to) != nullptr : to != nullptr)) return false;
    return !a.surfels.empty() && below(a.surfels, b->surface.nsurfel) &&
           (!to || below(a.node, to->surface.nsurfel));
  });
}

bool good_report(const Staged &t, const World &w) {
  const Report &r = t.report;
  if (r.n != t.store.n) return false;
  for (uint32_t i = 0; i < r.n; ++i) {
    const ContactPoint &c = r.contacts[i];
    const double *const values[] = {c.weight, c.point, c.normal, &c.distance, &c.area, c.velocity};
    const size_t counts[] = {4, 3, 3, 1, 1, 3};
    for (int k = 0; k < 6; ++k)
      if (!must::all_finite(values[k], counts[k])) return false;
    if (c.key != t.store.key[i] || c.kind > kPrimitive || c.obstacle > 1 || c.nnode > 4 || c.type_a > 2)
      return false;
    if (!t.store.touching[i] && c.slot_a == kNone) continue;  // of a removed body
    if (c.slot_a >= w.bodies.size()) return false;
    if (!t.store.touching[i]) continue;
    if (c.slot_b >= (c.obstacle ? w.obstacles.size() : w.bodies.size())) return false;
    if (w.bodies[c.slot_a]->id != t.store.id_a[i] ||
        (c.obstacle ? w.obstacles[c.slot_b]->id : w.bodies[c.slot_b]->id) != t.store.id_b[i])
      return false;
    const Surface &s = w.bodies[c.slot_a]->surface;
    if (c.feature_a >= (c.type_a == 0 ? s.nsurfel : c.type_a == 1 ? s.nedge : s.ntri)) return false;
  }
  return true;
}

void check(const SnapshotReader &s, const Staged &t, const World &w) {
  if (!s.at_end()) s.refuse("the end", "no bytes after the last field");
  if (!good_contacts(t, {w})) s.refuse("contacts", "contacts of bodies and obstacles that are there");
  if (!good_work(t.work, {w})) s.refuse("friction work", "pairs that are there, in order");
  if (!good_aside(t.overlaps.aside, {w}))
    s.refuse("pairs that are set aside", "bodies and obstacles that are there");
  if (!good_attachments(t.attachments, {w})) s.refuse("attachments", "surfels of bodies that are there");
  size_t sleepers = 0;
  for (const StagedBody &b : t.bodies) sleepers += b.slumber.asleep;
  if (sleepers != t.sleepers) s.refuse("sleepers", "as many as sleep");
  if (t.sleepers > 0 && !good_report(t, w)) s.refuse("report", "the contacts that are kept");
  for (size_t i = 0; i < t.rigid_sets.size(); ++i) {
    const RigidSet &set = *w.rigid_sets[i];
    for (size_t k = 0; k < set.group.size(); ++k)
      if (set.group[k] == DFM_RIGID_STILL &&
          std::memcmp(&t.rigid_sets[i].state[k], &set.state[k], sizeof(dfm_rigid_state)) != 0)
        s.refuse("rigid state", "a fixed body where it stands");
  }
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
    if (!in_range(type, l.params)) s.refuse("law parameters", "values in the range of the law's table");
    laws.push_back(std::make_unique<LawInstance>(type, w.context->host, l.params));
    for (const auto &own : w.laws)
      if (own->type == &type && own->params == l.params) {
        laws.back()->asked_type = own->asked_type;
        laws.back()->asked = own->asked;
      }
    most = std::max(most, laws.back()->nstate);
  }
  if (t.store.nstate > most) s.refuse("contact states", "no more than a law has");
  return laws;
}

// Derived data, therefore recomputed and not read.
void order_contacts(ContactStore &c) {
  c.by_key.resize(c.n);
  std::iota(c.by_key.begin(), c.by_key.end(), 0u);
  std::sort(c.by_key.begin(), c.by_key.end(),
            [&](uint32_t i, uint32_t j) { return c.key[i] != c.key[j] ? c.key[i] < c.key[j] : i < j; });
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
    if (!made_alike(other, b)) {
      const dfm_type &type = w.context->registry.find(DFM_KIND_MODEL, other.model.id);
      try {
        other.made = make_body_model(w, b, type, other.origin, static_cast<int32_t>(other.integrator.used));
      } catch (const Error &e) {
        if (e.status == DFM_E_NOMEM) throw;
        fail(DFM_E_FORMAT, "the snapshot's model does not fit this world: %s; nothing was restored",
             e.what());
      }
      Integrator &moves = other.made->integrator;
      moves.counted = other.integrator.counted;
      moves.chosen = moves.counted != Counted::no;
      moves.step = other.integrator.step;
      ModelInstance &made = other.made->instance;
      if (made.state.size() != other.model.state.size()) s.refuse("model state", "as many as the model has");
      if (made.params.size() != other.model.params.size() || !in_range(type, other.model.params))
        s.refuse("model parameters", "values in the range of the model's table");
      made.state.swap(other.model.state);
    } else {
      const bool counted = other.integrator.counted != Counted::no;
      other.integrator.open = !counted && b.integrator.open;
      other.integrator.chosen = counted || b.integrator.chosen;
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
      std::swap(b.integrator.counted, other.integrator.counted);
      std::swap(b.integrator.step, other.integrator.step);
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
    b.blades.swap(other.blades);
    std::swap(b.slumber, other.slumber);
    b.bound.known = false;
    b.anchor.swap(other.anchor);
    b.method_values.swap(other.method_values);
    if (!other.surfel_impulse.empty()) b.surfel_impulse.swap(other.surfel_impulse);
    if (b.slumber.asleep) gather_surface(b.surface, b.p.x.data(), b.p.v.data());
    update_inverse_mass(b.p);
  }
  for (size_t i = 0; i < w.obstacles.size(); ++i) {
    Obstacle &o = *w.obstacles[i];
    StagedObstacle &other = t.obstacles[i];
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
  std::swap(w.report, t.report);
  std::swap(w.stats, t.stats);
  std::swap(w.time, t.time);
  std::swap(w.step_count, t.step_count);
  std::swap(w.next_id, t.next_id);
  std::swap(w.hold, t.hold);
  std::swap(w.sizes, t.sizes);
  std::swap(w.purse, t.purse);
  std::swap(w.watch, t.watch);
  w.bound.body = nullptr;
  w.bound.point = 0;
  ++w.placements;
}

}  // namespace

void world_snapshot(const World &w, std::vector<unsigned char> &out, std::vector<SnapshotField> *map) {
  out.resize(sizeof(SnapshotHead));
  SnapshotWriter s(out, map);
  const std::vector<CutRow> cuts = cut_rows(w);
  cut_fields(s, cuts);
  fields(s, w, w);
  SnapshotHead head{{}, kSnapshotVersion, 0, out.size(), snapshot_structure(w), 0};
  std::memcpy(head.magic, kSnapshotMagic, sizeof head.magic);
  std::memcpy(out.data(), &head, sizeof head);
  head.checksum = snapshot_checksum(out.data(), out.size());
  std::memcpy(out.data(), &head, sizeof head);
}

namespace {

// Checks that it is complete, of this version, undamaged, and of a matching world.
void check_head(const World &w, const unsigned char *data, size_t bytes) {
  SnapshotHead head{};
  std::memcpy(&head, data, std::min(bytes, sizeof head));
  if (bytes < sizeof head.magic || std::memcmp(head.magic, kSnapshotMagic, sizeof head.magic - 1) != 0)
    fail(DFM_E_FORMAT, "these %zu bytes are not a snapshot; take one with dfm_world_snapshot", bytes);
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
  if (head.structure != snapshot_structure(w))
    fail(DFM_E_FORMAT,
         "the snapshot belongs to another world: names, meshes, masses, materials, fields and obstacles must "
         "be "
         "the same; nothing was restored");
}

}  // namespace

void world_restore(World &w, const void *data, size_t bytes) {
  const unsigned char *const p = static_cast<const unsigned char *>(data);
  check_head(w, p, bytes);
  SnapshotReader s(p + sizeof(SnapshotHead), p + bytes);
  std::vector<CutRow> cuts;
  cut_fields(s, cuts);
  SnapshotShapes shapes(w, cuts);
  Staged staged(w);
  fields(s, staged, w);
  for (StagedObstacle &o : staged.obstacles) o.material = o.zone.material;
  check(s, staged, w);
  make_models(s, w, staged);
  order_contacts(staged.store);
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
}

}  // namespace dfm
