// The fields of a snapshot: everything that later results depend on, and nothing else. Candidate lists are
// not included: contacts come from exact geometry, so rebuilt lists give the same contacts (broad/). What the
// host may change between two steps (loads, holds, motions, gravity, filters, friction rules, runtime
// parameters) is state too.
//
// A field is a member of BodyState, OnPoints, ObstacleState or WorldState, which a restore exchanges whole,
// and one line in one of the ..._fields() functions: its name, its location and its valid values.
// Writing, reading and checking (snapshot.cpp) use this line; conditions between fields are in check() there.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "core/error.h"
#include "deform/world.h"
#include "dynamics/rigid/rigid_set.h"
#include "friction/laws.h"
#include "plugin/params.h"
#include "snapshot/snapshot_cuts.h"
#include "snapshot/snapshot_stream.h"
#include "snapshot/snapshot_things.h"
#include "state/model_choice.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "state/world.h"
#include "world/body_model.h"

namespace dfm {

// ---- contents, read in full before the world changes (snapshot.cpp) ----

// Members have the names of those in World, Body and Obstacle, so that the lists of fields work for both.
struct StagedBody : BodyState, OnPoints {
  struct {
    Array<double> x, v, load;
    Array<uint8_t> held;
    Dampers dampers;
  } p;
  struct {
    std::string id;
    Array<double> state;
    std::vector<double> params;
  } model;
  struct { std::vector<double> requested; } switched_off;
  ModelOrigin origin;
  Integrator integrator;
  std::unique_ptr<MadeModel> made;  // if the body has another model than in the snapshot
  CutsAhead ahead;
  Array<double> surfel_impulse;
};
struct StagedObstacle : ObstacleState { dfm_obstacle_def def{}; };
struct StagedRigids {
  Array<dfm_rigid_state> state;
  Array<double> extra, total, wrench;
  Array<RigidMotor> motors;
};
struct StagedTool { Tool::Cuts cuts; };
struct StagedLaw {
  std::string id, requested_id;
  std::vector<double> params, requested;
  double restitution = kNoRestitution;
};
struct Staged : WorldState {
  double offset = 0;
  uint32_t sleepers = 0;
  WorldBound bound;
  Gravity gravity;
  dfm_world_def def{};
  std::vector<StagedBody> bodies;
  std::vector<StagedObstacle> obstacles;
  std::vector<StagedRigids> rigid_sets;
  std::vector<StagedTool> tools;
  std::vector<StagedLaw> laws;
  struct { std::vector<SuspendedPair> suspended; } overlaps;
  explicit Staged(const World &w) : WorldState(w.meters.contacts.memory()) {
    const Memory &m = w.memory();
    bodies.resize(w.bodies.size());
    obstacles.resize(w.obstacles.size());
    rigid_sets.resize(w.rigid_sets.size());
    tools.resize(w.tools.size());
    for (StagedBody &b : bodies)
      use_memory(m, b.p.x, b.p.v, b.p.dampers.v, b.p.dampers.slow, b.p.load, b.p.held, b.model.state,
                 b.surfel_impulse, b.anchor);
    for (StagedRigids &r : rigid_sets) use_memory(m, r.state, r.extra, r.total, r.wrench, r.motors);
  }
};

// ---- future models of a body ----

template <class Stream, class P>
void param_fields(Stream &s, P &params) {
  s.array("model's keys", params.keys, kAnyCount, must::any);
  s.array("model's widths", params.widths, kAnyCount, must::any);
  s.array("model's values", params.values, kAnyCount, must::finite);
  s.must_hold("model's keys", "as many as there are values for", [&] { return params.is_valid(); });
}

template <class Stream, class C>
void choice_fields(Stream &s, const char *name, C &c) {
  s.array(name, c.type, kAnyCount, must::any);
  param_fields(s, c.params);
  s.value(name, c.integrator, must::at_most(kSameIntegrator));
  s.value(name, c.max_jump, must::Be{[](double j) { return j > 0; }, "an energy above zero"});
}

template <class Stream, class B>
void switch_fields(Stream &s, B &b) {
  s.list("models to come", b.switches, [&](auto &x) {
    s.value("model to come", x.t, must::finite);
    choice_fields(s, "model to come", x.to);
  });
  s.list("rules of models", b.rule, [&](auto &r) {
    for (auto *c : {&r.touching, &r.near, &r.far}) choice_fields(s, "rule of models", *c);
    s.value("rule's point", r.point, must::finite);
    for (auto *x : {&r.distance, &r.hysteresis, &r.wait, &r.called})
      s.value("rule's value", *x, must::not_negative);
    s.value("rule's refusal", r.refused, must::finite);
    s.value("rule's level", r.level, must::at_most(uint32_t(SwitchLevel::undecided)));
  });
  s.must_hold("rules of models", "one rule at most, with a model for far",
              [&] { return b.rule.empty() || (b.rule.size() == 1 && !b.rule[0].far.type.empty()); });
}

}  // namespace dfm

namespace dfm::snapshot {

template <class T>
auto &object(T &x) {
  return x;
}
template <class T>
T &object(const std::unique_ptr<T> &x) {
  return *x;
}

inline std::string id_of(const LawInstance &law) { return law.type->id; }
inline std::string &id_of(StagedLaw &law) { return law.id; }
inline std::string requested_id_of(const LawInstance &law) { return law.requested_type->id; }
inline std::string &requested_id_of(StagedLaw &law) { return law.requested_id; }
inline std::string id_of(const ModelInstance &model) { return model.type->id; }
inline std::string &id_of(decltype(StagedBody::model) &model) { return model.id; }

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

inline bool fits(const dfm_type &type, const std::vector<double> &values) {
  if (values.size() != packed_width(type)) return false;
  try {
    pack_params(type, param_rows(type, values));
    return true;
  } catch (const Error &) {
    return false;
  }
}

inline bool good_state(const dfm_rigid_state &s) {
  return must::all_finite(s.position) && must::all_finite(s.velocity) && must::all_finite(s.spin) &&
         must::rotation.is(s.rotation);
}

inline bool good_stats(const dfm_world_stats &s) {
  return s.size == sizeof s && must::all_finite(s.time) && must::all_finite(s.residual) &&
         must::all_finite(s.contacts_mean) && must::all_finite(s.residual_max) && s.stable_step >= 0 &&
         must::all_finite(s.sleep_energy) && must::all_finite(s.sleep_momentum) &&
         must::all_finite(s.guard_lost);
}

inline uint64_t last_id(const World &w) {
  uint64_t last = w.obstacles.empty() ? 0 : w.obstacles.back()->id;
  for (const auto *list : {&w.bodies, &w.emptied})
    if (!list->empty()) last = std::max(last, list->back()->id);
  return last;
}

// s; no bound of a body in SI units is smaller, and a smaller one would stop the world
inline constexpr double kMinStep = 1e-15;

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

// Whether the body has the same model, with the same inputs, as in the snapshot; none has it whose cells the
// restore has put.
template <class B>
bool made_alike(B &b, const Body &like) {
  const ModelOrigin &mine = b.origin, &other = like.origin;
  const auto bits = [](const Pose &a, const Pose &c) { return std::memcmp(&a, &c, sizeof a) == 0; };
  return like.dynamics && id_of(b.model) == like.model.type->id && mine.params == other.params &&
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
  s.value(
      "chosen integrator", b.integrator.chosen,
      must::Be{[](Chosen x) { return x <= Chosen::in_impact; }, "no, explicit, implicit or in an impact"});
  s.value("spectral share", b.integrator.share,
          must::Be{[](double x) { return x > 0 && x <= 1; }, "a share above zero"});
  s.value("lag of dampers", b.p.dampers.lag,
          must::Be{[](double x) { return x >= 0 && std::isfinite(x); }, "a time"});
  const size_t lagged = b.p.dampers.lag > 0 ? like.p.x.size() : 0;
  s.array("velocity of dampers", b.p.dampers.v, lagged, must::finite);
  s.array("slow velocity of dampers", b.p.dampers.slow, lagged, must::finite);
  s.value("explicit sub-step", b.integrator.step,
          must::Be{[](double x) { return x > 0; }, "a time above zero"});
  const bool alike = made_alike(b, like);
  s.array("model state", b.model.state, alike ? like.model.state.size() : kAnyCount, must::finite);
  s.array("model parameters", b.model.params, alike ? like.model.params.size() : kAnyCount, must::finite);
  s.must_hold("model parameters", "values in the range of the model's table",
              [&] { return !alike || fits(*like.model.type, b.model.params); });
  s.array("requested parameters", b.switched_off.requested, kAnyCount, must::finite);
  s.must_hold("requested parameters", "none, or values in the range of the model's table", [&] {
    const std::vector<double> &values = b.switched_off.requested;
    return values.empty() || !alike || fits(*like.model.type, values);
  });
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
  s.must_hold("energy known", "what the energy watch writes", [&] { return is_valid(b.energy); });
  s.value("model has changed", b.changes.open, must::flag);
  s.value("refusal reported", b.changes.reported, must::flag);
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
    s.must_hold("sides of a blade", "those of cells",
                [&] { return is_valid(blade.sides, like.tets.size()); });
    s.value("blade's credit", blade.credit, must::finite);
    s.value("blade's part", blade.part, must::any);
    s.array("dues of a blade", blade.cut_work, kAnyCount, must::any);
    s.must_hold("dues of a blade", "those of points", [&] { return is_valid(blade.cut_work, like.p.n); });
  });
  s.list("cuts to come", b.planned_cuts, [&](auto &cut) {
    s.value("cut's time", cut.t, must::not_negative);
    s.value("cut's way", cut.how, must::at_most(uint32_t{DFM_CUT_SPLIT}));
    s.value("cut's limit", cut.most, must::any);
    s.value("cut's shape", cut.shape.kind,
            must::Be{[](CutKind k) { return k <= CutKind::plane; }, "a shape that cuts"});
    s.value("cut's rotation", cut.shape.rotation,
            must::Be{[](const Quat &q) { return must::pose.is(Pose{{}, q}); }, "a unit quaternion"});
    for (auto *x : {&cut.shape.position, &cut.shape.half_size, &cut.shape.way})
      s.value("cut's place", *x, must::finite);
    for (auto &x : cut.shape.corner) s.value("cut's corner", x, must::finite);
  });
  s.must_hold("cuts to come", "in order of time, and split by a blade or a plane",
              [&] { return is_valid(b.planned_cuts); });
  if (like.ahead.delay > 0) {
    const auto faces = [&](const char *name, auto &list) {
      s.array(name, list, kAnyCount, must::any);
      s.must_hold(name, "faces between cells of the body as it was made, ascending",
                  [&] { return is_valid(list, like); });
    };
    faces("faces that wait", b.ahead.faces);
    faces("faces that wait longer", b.ahead.later);
    s.value("faces open at", b.ahead.open_time, must::finite);
  }
  s.value("separates", b.separate.on, must::flag);
  s.value("crumbs go", b.separate.removes, must::flag);
  s.value("fewest cells of a piece", b.separate.least, must::any);
  s.value("parts wait for memory", b.separate.waits, must::flag);
  s.must_hold("parts wait for memory", "parts of a body that separates",
              [&] { return !b.separate.waits || b.separate.on; });
  s.value("asleep", b.sleep_state.asleep, must::flag);
  s.value("time at rest", b.sleep_state.quiet_time, must::not_negative);
  s.value("asleep since", b.sleep_state.since, must::not_negative);
  s.value("sub-step asleep", b.sleep_state.h, must::not_negative);
  s.value("force asleep", b.sleep_state.force, must::finite);
  s.must_hold("asleep", "a sleep that began in a sub-step before now, where bodies may sleep", [&] {
    return !b.sleep_state.asleep || (w.def.sleep && b.sleep_state.since <= w.time && b.sleep_state.h > 0);
  });
  s.array("surfel impulse", b.surfel_impulse, like.surfel_impulse.size(), must::finite);
  if (w.def.sleep) s.array("anchor", b.anchor, like.p.x.size(), must::finite);
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
        else if constexpr (kind == V::feature) s.array(column.name, values, count, must::at_most(2));
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
  s.array("pairs that are set aside", w.overlaps.suspended, kAnyCount,
          must::Be{[](const SuspendedPair &x) { return x.obstacle <= 1 && x.a != x.b; }, "two things"});
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
    s.value("attachment parted", a.parted, must::flag);
  });
}

template <class Stream, class W>
void fields(Stream &s, W &w, const World &like) {
  s.list("laws", w.laws, [&](auto &entry) {
    auto &l = object(entry);
    s.array("law", id_of(l), kAnyCount, must::any);
    s.must_hold("law", "the name of a law", [&] { return !id_of(l).empty(); });
    s.array("law parameters", l.params, kAnyCount, must::finite);
    s.array("requested law", requested_id_of(l), kAnyCount, must::any);
    s.array("requested law's parameters", l.requested, kAnyCount, must::finite);
    s.value("law's restitution", l.restitution,
            must::Be{[](double x) { return x == kNoRestitution || (x >= 0 && x <= 1); }, "from 0 to 1"});
  });
  s.value("time", w.time, must::not_negative);
  s.value("steps", w.step_count, must::any);
  s.value("step bound", w.bound.step, must::Be{[](double x) { return x >= 0; }, "a time above zero"});
  s.value("inverted cells", w.bound.inverted, must::any);
  s.value("age of the bound", w.bound.age, must::any);
  s.value("strain since the bound", w.bound.strain, must::not_negative);
  s.must_hold("step bound", "a time that a sub-step can have",
              [&] { return w.bound.age == kNone || w.bound.step >= kMinStep; });
  for (auto *r : {&w.sizes.cut, &w.sizes.offer}) {
    s.value("step size", r->size, must::not_negative);
    s.value("quiet steps of the size", r->quiet_steps, must::any);
    s.value("patience", r->patience, must::any);
  }
  s.value("accurate step", w.sizes.accurate, must::not_negative);
  s.value("time of steady steps", w.sizes.steady, must::not_negative);
  s.value("damping of changed steps", w.sizes.damping, must::not_negative);
  s.value("end of an impact", w.impact_until, must::not_negative);
  s.must_hold("step size", "sizes that the library chooses", [&] { return is_valid(w.sizes); });
  s.value("age of the energies", w.watch.age, must::any);
  s.value("credit of the energies", w.watch.credit, must::any);
  s.value("last sub-step", w.watch.last_h, must::not_negative);
  s.value("energy made by contact", w.watch.made, must::not_negative);
  s.value("energy made by friction", w.watch.rubbed, must::finite);
  s.value("pair that has made energy", w.watch.side, must::any);
  s.must_hold("last sub-step", "what the energy watch writes", [&] { return is_valid(w.watch); });
  s.value("contact offset", w.offset, must::positive);
  s.value("hold start", w.hold.start, must::finite);
  s.value("holding", w.hold.on, must::flag);
  s.value("statistics", w.stats,
          must::Be{[](const dfm_world_stats &x) { return good_stats(x); }, "finite statistics"});
  s.value("gravity", w.gravity.now, must::finite);
  s.value("gravity", w.def.gravity, must::finite);
  s.value("next id", w.next_id,
          must::Be{[&](uint64_t x) { return x > last_id(like) && x < kMaxIds; },
                   "a number above all that are taken"});
  s.array("gravity keys", w.gravity.keys, kAnyCount, must::any);
  s.must_hold("gravity keys", "finite keys at rising times", [&] { return rise(w.gravity.keys); });
  s.value("sleep", w.def.sleep, must::flag);
  s.value("sleepers", w.sleepers, must::any);
  size_t at = 0;
  s.members("bodies", w.bodies, like.bodies.size(),
            [&](auto &entry) { body_fields(s, w, object(entry), *like.bodies[at++]); });
  at = 0;
  s.members("obstacles", w.obstacles, like.obstacles.size(), [&](auto &entry) {
    auto &o = object(entry);
    const Obstacle &l = *like.obstacles[at++];
    s.where("obstacle", l.name);
    if (!(l.rigid && l.rigid->njoint)) s.value("first pose", o.def.pose, must::given_pose);
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
    s.must_hold("material", "a name, of one that may be destroyed",
                [&] { return o.zone.material.find('\0') == std::string::npos; });
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
    s.array("motors", r.motors, l.motors.size(),
            must::Be{[](const RigidMotor &x) {
                       return std::isfinite(x.velocity) && x.max >= 0 && std::isfinite(x.max);
                     },
                     "a finite speed and a finite limit that is not negative"});
    s.array("impulse", r.total, l.total.size(), must::finite);
    s.array("contact wrench", r.wrench, l.wrench.size(), must::finite);
  });
  at = 0;
  s.members("tools", w.tools, like.tools.size(), [&](auto &entry) {
    auto &cuts = object(entry).cuts;
    const Tool &l = *like.tools[at++];
    s.where("tool", l.name);
    s.value("way of cutting", cuts.how, must::any);
    s.value("most of a cut", cuts.most, must::any);
    s.array("bodies that it cuts", cuts.bodies, kAnyCount, must::any);
    s.must_hold("bodies that it cuts", "ascending numbers, of a tool that cuts in this way",
                [&] { return is_valid(cuts, l); });
    s.value("way is yet to be cut", cuts.waits, must::flag);
    if (cuts.waits) s.array("start of the way", cuts.from, l.motion.parts.size(), must::pose);
  });
  s.where("", "");
  attachment_fields(s, w);
  rule_fields(s, w, w.laws.size());
  contact_fields(s, w.store, w.laws.size());
  s.where("contacts of tools", "");
  contact_fields(s, w.tool_store, w.laws.size());
  s.where("", "");
  s.array("friction work", w.work, kAnyCount,
          must::Be{[](const PairWork &x) { return std::isfinite(x.friction); }, "finite work"});
}

}  // namespace dfm::snapshot
