// Derived data, recomputed when something has changed: plan, pair tables, rest distance, views of the
// entities for the stages.
#include "state/world.h"
#include "step/context.h"
#include "step/stages.h"

#include <algorithm>
#include <bit>
#include <map>
#include <utility>
#include <vector>

#include "body/implicit_system.h"
#include "body/obstacle_mesh.h"
#include "core/error.h"
#include "geometry/voxel_grid.h"
#include "plan/integrators.h"
#include "plugin/context.h"
#include "state/bounds.h"
#include "state/partner.h"
#include "state/tool.h"
#include "step/overlap/overlap.h"
#include "step/pair_table.h"
#include "step/rigid/rigid.h"
#include "step/rigid/tool_touch.h"
#include "step/rigid/tools.h"
#include "step/self_contact.h"
#include "step/solve/cut_drag.h"
#include "step/watch/energy_watch.h"

namespace dfm {
namespace {

// Kinds of things (bodies, obstacles) that no rule of friction or contact tells apart: the same patterns
// match them, by name, group and material, and their zones have the same coefficients. Rules are then asked
// once for two kinds, and not for each pair: a body that shatters has hundreds of pieces, all of one or two
// kinds, and the tables of pairs are made again after each cut and each separation.
struct PairOfKinds {
  bool known = false;
  const FilterRule *filter = nullptr;  // nullptr: no rule names the pair
  PairLaw law;                         // of the first pair of these kinds that may touch
};

// What each pattern of the rules weighs at this side.
template <class Rule>
void weigh(const std::vector<Rule> &rules, const PairSide &side, std::vector<uint64_t> &key) {
  for (const Rule &r : rules)
    for (const std::string &pattern : r.between) key.push_back(uint64_t(pattern_weight(pattern, side)));
}

// As a whole thing, and by zone.
std::vector<uint64_t> key_of(const World &w, uint32_t thing) {
  std::vector<uint64_t> key;
  const PairSide side = partner_of(w, thing).side;
  weigh(w.filters, side, key);
  const auto add = [&](const SurfaceZones::Zone &zone) {
    key.push_back(std::bit_cast<uint64_t>(zone.friction));
    weigh(w.friction, {side.name, zone.group, zone.material, side.whole}, key);
  };
  const size_t nb = w.bodies.size();
  if (thing < nb)
    for (const SurfaceZones::Zone &zone : w.bodies[thing]->zones.list) add(zone);
  else add(w.obstacles[thing - nb]->zone);
  return key;
}

// By thing: bodies by slot, then obstacles. n: out, how many there are.
std::vector<size_t> kinds_of(const World &w, size_t &n) {
  std::map<std::vector<uint64_t>, size_t> known;
  std::vector<size_t> out;
  for (uint32_t thing = 0; thing < w.bodies.size() + w.obstacles.size(); ++thing)
    out.push_back(known.try_emplace(key_of(w, thing), known.size()).first->second);
  n = known.size();
  return out;
}

// Rest distance d_c: 1e-3 of the median surface edge, at least 64 rounding units of the largest coordinate,
// at most 0.1 of the thinnest part: of the least mean thickness and of the shortest median edge.
double contact_offset(const World &w) {
  double edge = 0, shortest = 0, extent = 0;
  std::vector<double> edges;
  for (auto &b : w.bodies) {
    edges.push_back(b->surface.median_edge);
    const double thin = std::min(b->surface.median_edge, thickness(*b));
    shortest = shortest == 0 ? thin : std::min(shortest, thin);
    for (double x : b->p.x) extent = std::max(extent, std::fabs(x));
  }
  if (edges.empty()) return 1e-6;
  std::nth_element(edges.begin(), edges.begin() + std::ptrdiff_t(edges.size() / 2), edges.end());
  edge = edges[edges.size() / 2];
  return std::min(std::max(1e-3 * edge, 64 * 2.220446049250313e-16 * extent), 0.1 * shortest);
}

void offer(const dfm_type &type, std::vector<SceneFacts::Provider> &to) {
  for (const std::string &e : effects(type)) to.push_back({e, type.id});
}

Varying varying(const World &w) {
  Varying p;
  p.gravity_keys = !w.gravity.keys.empty();
  for (auto &b : w.bodies) {
    p.loads_vary |= b->loads_vary();
    p.held_move |= !b->motions.empty();
  }
  for (auto &o : w.obstacles) p.obstacles_move |= o->moves() || o->has_target;
  return p;
}

// Updates only the plan, if changed values call for another stage.
void check_plan(World &w, StepContext &step) {
  const Varying now = varying(w);
  if (now != static_cast<const Varying &>(step.facts)) {
    SceneFacts facts = step.facts;
    static_cast<Varying &>(facts) = now;
    w.plan = make_plan(facts);
    step.facts = std::move(facts);
    ++step.made.plans;
  }
  w.revalued = false;
}

void view_bodies(World &w, StepContext &step, SceneFacts &facts) {
  step.body_views.clear();
  step.sources.clear();
  step.systems.clear();
  step.bodies_part = false;
  uint32_t node = 0, point = 0;
  for (uint32_t i = 0; i < w.bodies.size(); ++i) {
    Body &b = *w.bodies[i];
    b.slot = i;
    facts.self_stepping += !b.dynamics->abilities().forces;
    step.bodies_part = step.bodies_part || b.dynamics->abilities().parts;
    const Surface &s = b.surface;
    step.body_views.push_back({i, node, b.category, b.collides_with, b.id, &s});
    const Unknowns own = b.dynamics->unknowns();
    step.systems.push_back(own.system);
    step.sources.push_back({node, s.nsurfel, point, b.p.n, &s,
                            own.system ? own.system->diagonal_inverse() : own.diagonal, own.velocity});
    if (!s.identity()) {
      ++facts.coupled;
      facts.coupled_surfels += s.nsurfel;
    }
    node += s.nsurfel;
    point += b.p.n;
    for (const std::string &e : effects(*b.model.type))
      (b.model.works(e) ? facts.offered : facts.idle).push_back({e, b.model.type->id});
  }
}

ObstacleView view_of(Obstacle &o) {
  ObstacleView v = o.view();
  v.slot = o.slot;
  v.category = o.def.category;
  v.collides_with = o.def.collides_with;
  v.id = o.id;
  if (v.shape == Shape::none) v.category = v.collides_with = 0;
  v.belt = load3(o.def.velocity_surface);
  if (o.mesh) {
    o.mesh->place(v.position, v.rotation, {}, {});
    v.surface = &o.mesh->surface;
  }
  v.grid = o.grid.get();
  return v;
}

void view_obstacles_anew(World &w, StepContext &step) {
  step.obstacle_views.clear();
  for (uint32_t i = 0; i < w.obstacles.size(); ++i) {
    w.obstacles[i]->slot = i;
    step.obstacle_views.push_back(view_of(*w.obstacles[i]));
  }
}

void view_rigids(World &w, SceneFacts &facts) {
  place_rigids(w);
  for (auto &set : w.rigid_sets) {
    facts.rigid_bodies += static_cast<unsigned>(set->defs.size());
    facts.rigid_joints += set->njoint;
    if (facts.rigid_hosts.find(set->host_name) == std::string::npos)
      facts.rigid_hosts += (facts.rigid_hosts.empty() ? "" : ", ") + set->host_name;
    facts.offered.push_back({"two_way_rigid", "rigid host " + set->host_name});
  }
}

bool before_pair(const PairDecision &l, const PairDecision &r) { return l.a != r.a ? l.a < r.a : l.b < r.b; }

// For a pair allowed by masks and rules: whether one is a sensor, or the host refuses. The host is called if
// it has not answered yet: things i < j.
bool refused(const World &w, const StepContext &step, uint32_t i, uint32_t j, const Partner &a,
             const Partner &b, std::vector<PairDecision> &decisions) {
  if (a.sensor || b.sensor) return true;
  if (!w.may_touch.call || !b.has_shape()) return false;
  if (j < i) return !w.pairs.filter.may_touch(step.body_views[j], step.body_views[i]);
  const auto find = [](const std::vector<PairDecision> &in, const PairDecision &pair) {
    const auto at = std::lower_bound(in.begin(), in.end(), pair, before_pair);
    return at != in.end() && !before_pair(pair, *at) ? &*at : nullptr;
  };
  PairDecision pair{a.id, b.id, false};
  if (const PairDecision *const known = find(w.may_touch.decisions, pair)) {
    pair.touch = known->touch;
  } else {
    const auto handle = [&](uint32_t thing) {
      const size_t nb = w.bodies.size();
      return thing < nb ? w.bodies[thing]->handle : w.obstacles[thing - nb]->handle;
    };
    pair.touch = w.may_touch.call(w.may_touch.user, handle(i), handle(j));
  }
  decisions.push_back(pair);
  return !pair.touch;
}

// Two attached things do not touch, unless requested. This applies to all shapes of a rigid body.
bool parted(const World &w, uint32_t i, uint32_t thing) {
  const uint32_t nb = static_cast<uint32_t>(w.bodies.size());
  const uint64_t a = w.bodies[i]->id;
  return std::any_of(w.attachments.begin(), w.attachments.end(), [&](const Attachment &x) {
    if (x.released || (x.flags & DFM_ATTACH_TOUCH)) return false;
    if (thing < nb) {
      const uint64_t b = w.bodies[thing]->id;
      return !x.obstacle && ((x.body == a && x.to == b) || (x.body == b && x.to == a));
    }
    if (!x.obstacle || x.body != a) return false;
    const Obstacle &o = *w.obstacles[thing - nb], &to = *w.obstacles[obstacle_slot_of(w, x.to)];
    return o.id == x.to || (o.rigid && o.rigid == to.rigid && o.rigid_body == to.rigid_body);
  });
}

unsigned paid_cuts(const World &w) {
  unsigned out = 0;
  for (auto &b : w.bodies)
    out += tough(*b) && std::any_of(w.tools.begin(), w.tools.end(), [&](auto &t) {
             return t->cuts.how == DFM_CUT_SPLIT && t->cuts_body(*b);
           });
  return out;
}

bool cut_through(const World &w, uint32_t i, uint32_t thing) {
  const size_t nb = w.bodies.size();
  return !w.tools.empty() && thing >= nb && passes_through(w, *w.bodies[i], *w.obstacles[thing - nb]);
}

// By slot: does any attachment hold the body or hold something at it? Few do, of many pieces.
std::vector<uint8_t> attached_bodies(const World &w) {
  std::vector<uint8_t> out;
  for (const auto &b : w.bodies)
    out.push_back(std::any_of(w.attachments.begin(), w.attachments.end(), [&](const Attachment &x) {
      return x.body == b->id || (!x.obstacle && x.to == b->id);
    }));
  return out;
}

// Filters, then laws. The default law is made only when a pair needs it. This runs after each cut and each
// separation for all pairs, so what depends on their kinds alone is found once for each two kinds.
void make_pair_tables(World &w, StepContext &step, SceneFacts &facts) {
  const uint32_t nb = static_cast<uint32_t>(w.bodies.size());
  const uint32_t width = nb + static_cast<uint32_t>(w.obstacles.size());
  // increases, so that lists made with older rules are rebuilt
  const uint64_t filter_version = w.pairs.filter.version;
  w.pairs.filter = PairFilter(w.meters.detection.memory());
  w.pairs.filter.version = filter_version + 1;
  w.pairs.law.assign(size_t(nb) * width, 0);
  w.pairs.zone_table.clear();
  w.pairs.zone_law.clear();
  for (auto &law : w.laws) law->by_default = false;
  std::vector<PairDecision> decisions;  // kept, or given now
  std::vector<uint32_t> used;
  std::vector<uint8_t> reported;  // by law: its effects are listed once, however many pairs use it
  const std::vector<uint8_t> attached = attached_bodies(w);
  std::vector<Partner> things;
  for (uint32_t i = 0; i < width; ++i) things.push_back(partner_of(w, i));
  size_t nkind = 0;
  const std::vector<size_t> kind = kinds_of(w, nkind);
  std::vector<PairOfKinds> kinds(nkind * nkind);
  for (uint32_t i = 0; i < nb; ++i) {
    const Partner &a = things[i];
    for (uint32_t j = 0; j < width; ++j) {
      if (j == i) continue;
      const bool is_body = j < nb;
      const Partner &b = things[j];
      PairOfKinds &pair = kinds[nkind * kind[i] + kind[j]];
      if (!pair.known) pair.filter = best_rule(w.filters, a.side, b.side);
      pair.known = true;
      bool touch = a.meets(b, pair.filter);
      if (pair.filter && (!is_body || i < j)) w.pairs.filter.set(a.id, b.id, !is_body, touch);
      if (touch && ((attached[i] && parted(w, i, j)) || cut_through(w, i, j) ||
                    refused(w, step, i, j, a, b, decisions))) {
        if (!is_body || i < j) w.pairs.filter.set(a.id, b.id, !is_body, false);
        touch = false;
      }
      if (!touch || !b.has_shape()) continue;
      if (is_body) facts.body_pairs += i < j;
      else ++facts.obstacle_pairs;
      if (pair.law.found()) {
        put_law(w, i, j, pair.law);
        continue;
      }
      pair.law = find_law(w, i, j, used);
      reported.resize(w.laws.size());
      for (uint32_t law : used)
        if (!std::exchange(reported[law], uint8_t{1})) offer_law(*w.laws[law], facts);
    }
  }
  std::sort(decisions.begin(), decisions.end(), before_pair);
  w.may_touch.decisions.swap(decisions);
  keep_suspended(w);
  facts.effects_listed = w.selection.listed();
  facts.requested = w.selection.names();
  choose_self_bodies(w, step, facts, used);
}

// Assumes the number of sub-steps that the step has without the other bodies; nothing else is known.
IntegratorOption option_of(const World &w, const Body &b) {
  IntegratorOption o;
  o.substeps = std::max(1.0, w.def.step / b.integrator.step);
  o.work = double(b.p.n) + double(b.ncell());
  if (!b.model.stepper && b.model.can(DFM_CAP_STIFFNESS))
    o.implicit_work = b.model.can(DFM_CAP_CONSTANT_STIFFNESS) ? kConstantWork : kImplicitWork;
  o.open = b.integrator.open;
  o.implicit =
      b.integrator.used != DFM_INTEGRATOR_SYMPLECTIC_EULER || b.integrator.chosen == Chosen::in_impact;
  return o;
}

// "body 'first' is", "body 'first' and 4 more are"
std::string names_of(const std::string &first, size_t count) {
  if (count == 1) return format("body '%s' is", first.c_str());
  return format("body '%s' and %zu more are", first.c_str(), count - 1);
}

// Chooses for bodies that have come since the last step and leave it to the library. Before the first step it
// is one choice for all of them, in whatever order they came and whatever was queried in between.
void choose_integrators(World &w) {
  const auto open = [](const auto &b) { return b->integrator.open; };
  if (std::none_of(w.bodies.begin(), w.bodies.end(), open)) return;
  if (w.step_count == 0) {
    reopen_integrators(w);
    w.impact_until = 0;
  }
  std::vector<IntegratorOption> options;
  for (const auto &b : w.bodies) options.push_back(option_of(w, *b));
  choose_integrators(options);
  // A body that comes while others are explicit because of an impact is so, too, and goes back with them.
  const bool in_impact = w.impact_until > 0;
  // One warning for all bodies of a scheme, and none for those that come later: a game makes many.
  struct SchemeCount {
    const Body *first = nullptr;
    size_t count = 0;
    double substeps = 0, step = 0;  // of the stiffest
  } reported[2];
  for (size_t i = 0; i < options.size(); ++i) {
    Body &b = *w.bodies[i];
    if (!b.integrator.open) continue;
    const bool was = b.integrator.used != DFM_INTEGRATOR_SYMPLECTIC_EULER;
    const bool now = options[i].implicit && !in_impact;
    if (now != was) {
      const ImplicitOptions chosen = implicit_choice(w, b);
      b.dynamics = make_dynamics(w.meters.dynamics.memory(), b.p, b.surface, b.model, b.edges,
                                 now ? &chosen : nullptr);
      b.relax_dampers();
      b.integrator.used = now ? implicit_integrator(w, b) : uint32_t{DFM_INTEGRATOR_SYMPLECTIC_EULER};
      if (now) {
        SchemeCount &own = reported[chosen.second_order];
        if (!own.first) own.first = &b;
        ++own.count;
        if (options[i].substeps > own.substeps) {
          own.substeps = options[i].substeps;
          own.step = b.integrator.step;
        }
      }
    }
    b.integrator.open = false;
    b.integrator.chosen = !options[i].implicit ? Chosen::explicitly
                          : in_impact          ? Chosen::in_impact
                                               : Chosen::implicit;
  }
  if (w.integrator_times.reported) return;
  for (const bool second_order : {true, false}) {
    const SchemeCount &own = reported[second_order];
    if (!own.first) continue;
    w.integrator_times.reported = true;
    w.context->warn(
        "%s integrated by %s, which damps %s, since explicit integration would take %.0f sub-steps of %.3g s "
        "per step; set the integrator of a body to choose one",
        names_of(own.first->name, own.count).c_str(), second_order ? "tr_bdf2" : "implicit_euler",
        second_order ? "contacts and unresolved vibrations" : "motion", std::ceil(own.substeps), own.step);
  }
}

// planned: the facts of the present plan.
void choose_plan(World &w, StepContext &step, SceneFacts &facts, const SceneFacts &planned) {
  for (const dfm_type *t : w.context->registry.list()) offer(*t, facts.available);
  for (const dfm_type *t : w.context->registry.list(DFM_KIND_FRICTION)) {
    if (!is_frictionless(law_of(*t))) facts.available.push_back({kFriction, t->id});
    if (law_of(*t).nslot) facts.available.push_back({kMemory, t->id});
  }
  facts.unguarded = w.def.flags & DFM_WORLD_UNGUARDED;
  const bool touch = facts.body_pairs + facts.obstacle_pairs + facts.self_bodies > 0;
  for (const char *own : {kSelfContact, kGuard}) facts.available.push_back({own, "contact"});
  if (facts.bodies && facts.effects_listed) {
    facts.offered.push_back({kSelfContact, "contact"});
    if (!touch) facts.offered.push_back({kFriction, "contact"});
  }
  if (!facts.unguarded && (touch || (facts.bodies && facts.effects_listed)))
    facts.offered.push_back({kGuard, "contact"});
  if (facts == planned) return;
  w.plan = make_plan(facts);
  ++step.made.plans;
}

// While contacts exist, also of rigid things with each other, it only decreases: a larger value would turn
// their rest distance into a depth, and push them apart at 0.1 d_c / h.
double choose_offset(const World &w, const SceneFacts &facts) {
  if (w.def.contact_offset > 0) return w.def.contact_offset;
  const double wanted = contact_offset(w);
  const bool exist = (when::acts(facts) && w.store.n > 0) || w.tool_store.n > 0;
  return exist ? std::min(w.offset, wanted) : wanted;
}

}  // namespace

ImplicitOptions implicit_choice(const World &w, const Body &b) {
  ImplicitOptions out = w.implicit;
  out.second_order = out.newton != 1 || b.model.can(DFM_CAP_CONSTANT_STIFFNESS);
  return out;
}

uint32_t implicit_integrator(const World &w, const Body &b) {
  return implicit_choice(w, b).second_order ? DFM_INTEGRATOR_TR_BDF2 : DFM_INTEGRATOR_IMPLICIT_EULER;
}

void reopen_integrators(World &w) {
  for (const auto &b : w.bodies)
    b->integrator.open = b->integrator.open || b->integrator.chosen != Chosen::no;
}

void values_changed(World &w) {
  w.revalued = true;
  w.bound.age = kNone;
  forget_energy(w);
}

void set_gravity_now(World &w) {
  w.gravity.now = w.gravity.keys.empty() ? load3(w.def.gravity) : vector_at(w.gravity.keys, w.time);
}

void prepare(World &w, const RestoredChoice *restored) {
  StepContext &step = *w.steps;
  if (!w.changed) {
    if (w.revalued) check_plan(w, step);
    return resolve_overlaps(w);
  }
  for (auto &b : w.bodies) b->dynamics->see_points();
  choose_integrators(w);
  const uint32_t nb = static_cast<uint32_t>(w.bodies.size());
  SceneFacts &facts = step.facts;
  const SceneFacts planned = std::exchange(facts, {});
  struct Unplanned {  // where this fails before there is a plan, the next call makes one
    SceneFacts *facts;
    World &w;
    double offset;
    ~Unplanned() {
      if (!facts) return;
      *facts = {};
      w.offset = offset;
    }
  } unplanned{&facts, w, w.offset};
  facts.bodies = nb;
  facts.obstacles = static_cast<unsigned>(w.obstacles.size());
  facts.sleep = w.def.sleep != 0;
  facts.attachments = static_cast<unsigned>(w.attachments.size());
  facts.paid_cuts = paid_cuts(w);
  static_cast<Varying &>(facts) = varying(w);
  step.exchange.clear();
  view_bodies(w, step, facts);
  view_obstacles_anew(w, step);
  view_rigids(w, facts);
  make_pair_tables(w, step, facts);
  w.offset = restored ? restored->offset : choose_offset(w, facts);
  step.tools->prepare(w, facts);
  w.pairs.laws.clear();
  for (auto &l : w.laws) w.pairs.laws.push_back(l.get());
  choose_plan(w, step, facts, planned);
  unplanned.facts = nullptr;
  if (!restored && !w.plan.touches()) end_contacts(w);
  if (!w.plan.has(StageRole::finds_contacts) && !facts.self_bodies) step.contacts.clear();

  if (!restored) check_offset(w);
  for (auto &b : w.bodies)
    if (!b->surface.coincident.empty()) b->surface.back = 0.5 * w.offset;
  for (auto &b : w.bodies)
    if (w.def.sleep && b->anchor.empty()) b->anchor = b->p.x;
  step.active.reserve(nb);
  step.surface_motions.reserve(nb);
  step.sinks.reserve(nb);
  reserve_sleep(w, step, nb);
  if (w.sleepers > 0 && w.offset != unplanned.offset)
    wake_all(w);  // the rest distance of contacts has changed
  gather_active(w);
  set_gravity_now(w);
  w.bound.age = kNone;
  step.free_kinetic.resize(nb);
  if (!restored) {
    forget_energy(w);
  } else {
    w.gravity.now = restored->gravity;
    w.bound = restored->bound;
  }
  step.guard.forget();
  w.changed = w.revalued = false;
  ++step.made.tables;
  resolve_overlaps(w);
}

}  // namespace dfm
