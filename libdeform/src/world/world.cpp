// What the world knows about itself between steps: names, pair tables, offset, plan.
#include "world/world.h"

#include <algorithm>

#include "core/error.h"
#include "friction/pair_rules.h"
#include "world/bounds.h"

namespace dfm {

bool Body::loads_vary() const {
  return !springs.empty() || std::any_of(loads.begin(), loads.end(), [](const Load &l) { return !l.keys.empty() || l.sine.amplitude[0] != 0; });
}

double Body::impulse_time() const { return slumber.asleep ? slumber.h : world->report.h; }

dfm_kin Body::kin(double t, double h, double *state_out) const {
  dfm_kin k{};
  k.size = sizeof k, k.stride = kStride, k.t = t, k.dt = h;
  k.x = p.x.data(), k.v = p.v.data();
  k.state = model.state.data(), k.state_out = state_out;
  return k;
}

Pose Obstacle::pose_at_time(double t) const {
  Pose p = keys.empty() ? to_pose(def.pose) : pose_at(keys, t);
  if (def.sine.frequency != 0 || def.sine.phase != 0) p.position += sine_at(def.sine, t) * load3(def.sine.amplitude);
  return p;
}

World::World(dfm_context *c)
    : context(c), broad(c->memory), rows(c->memory), acceleration(c->memory), store(c->memory), next_store(c->memory), batches(c->memory), areas(c->memory),
      exchange(c->memory), renewal(c->memory), rollback(c->memory), islands(c->memory) {
  const Memory &m = c->memory;
  use_memory(m, driven, lent, contacts, tolerance.normal, tolerance.tangent, disturbance, best_impulse, tangents, match, sharing, aim, stands, ways, renewed,
             block_surfels, block_impulse, block_velocity);
  GuardMemory &known = guard.memory;
  use_memory(m, known.runs, known.old_runs, known.features, known.old_features, known.rest, known.old_rest, known.normal, known.old_normal);
  for (Report *r : {&report, &last_report}) use_memory(m, r->contacts, r->frame, r->impulse, r->slip, r->mode);
  use_memory(m, active, woken, stirred, free_kinetic, step_impulses.pairs);
  use_memory(m, guard.joined, guard.near, guard.hits, guard.speed, guard.change, guard.kept);
  use_memory(m, state.law, state.fn, state.vt, state.ft_stop, state.area, state.dwell, state.bristle, state.ft, state.dft_dvt, state.dft_dfn, state.limit,
             state.bristle_out, state.mode, state.set_valued);
  stats.size = sizeof stats;
}

Body *World::find_body(const std::string &name) {
  for (auto &b : bodies)
    if (b->name == name) return b.get();
  return nullptr;
}

Obstacle *World::find_obstacle(const std::string &name) {
  for (auto &o : obstacles)
    if (o->name == name) return o.get();
  return nullptr;
}

uint64_t World::handle_of(uint64_t id) const {
  for (auto &b : bodies)
    if (b->id == id) return b->handle;
  for (auto &o : obstacles)
    if (o->id == id) return o->handle;
  return 0;
}

uint32_t World::add_law(const char *name, std::span<const dfm_param_value> values, std::span<const uint8_t> free) {
  const dfm_type &type = context->registry.find(DFM_KIND_FRICTION, name);
  std::vector<double> packed = pack_params(type, values);
  for (uint32_t i = 0; i < laws.size(); ++i)
    if (laws[i]->type == &type && laws[i]->params == packed) return i;
  auto law = std::make_unique<LawInstance>(type, context->host, std::move(packed));
  rollback_check_law(*this, name, law->nstate);
  for (uint32_t i = 0; i < free.size(); ++i)
    if (free[i]) return laws[i] = std::move(law), changed = true, i;
  laws.push_back(std::move(law));
  return static_cast<uint32_t>(laws.size() - 1);
}

namespace {

// Rest distance d_c: 1e-3 of the median surface edge, at least 64 rounding units of the largest coordinate, at most 0.1 of the thinnest part:
// of the least mean thickness and of the shortest median edge.
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

}  // namespace

void World::prepare(const RestoredChoice *restored) {
  if (!changed) return settle_overlaps(*this);
  const uint32_t nb = static_cast<uint32_t>(bodies.size()), no = static_cast<uint32_t>(obstacles.size()), width = nb + no;
  SceneFacts facts;
  facts.bodies = nb, facts.obstacles = no;
  facts.gravity_keys = !gravity_keys.empty(), facts.sleep = def.sleep != 0, facts.rollback = def.method == DFM_METHOD_ROLLBACK;

  body_views.clear(), obstacle_views.clear(), sources.clear(), exchange.clear();
  uint32_t node = 0, point = 0;
  for (uint32_t i = 0; i < nb; ++i) {
    Body &b = *bodies[i];
    b.slot = i;
    facts.self_stepping += b.model.stepper != nullptr;
    facts.loads_vary |= b.loads_vary(), facts.held_move |= !b.motions.empty();
    const Surface &s = b.surface;
    body_views.push_back({i, node, b.category, b.collides_with, b.id, &s});
    sources.push_back({node, s.nsurfel, point, b.p.n, &s, b.model.stepper ? nullptr : b.p.inv_mass.data(),
                       b.model.stepper ? s.v.data() : b.p.v_free.data()});
    if (!s.identity()) ++facts.coupled, facts.coupled_surfels += s.nsurfel;
    node += s.nsurfel, point += b.p.n;
    for (const std::string &e : effects(*b.model.type)) (b.model.works(e) ? facts.offered : facts.idle).push_back({e, b.model.type->id});
  }
  for (uint32_t i = 0; i < no; ++i) {
    Obstacle &o = *obstacles[i];
    o.slot = i;
    facts.obstacles_move |= o.moves() || o.has_target;
    ObstacleView v{};
    v.slot = i, v.category = o.def.category, v.collides_with = o.def.collides_with, v.id = o.id, v.shape = Shape(o.def.shape);
    if (v.shape == Shape::none) v.category = v.collides_with = 0;
    v.position = o.pose.position, v.rotation = o.pose.rotation, v.half_size = load3(o.def.half_size);
    v.radius = o.def.radius, v.half_length = o.def.half_length, v.belt = load3(o.def.velocity_surface);
    if (o.mesh) {
      o.mesh->place(v.position, v.rotation, {}, {});
      v.surface = &o.mesh->surface, v.extent = o.mesh->extent;
    }
    if (o.grid) v.grid = o.grid.get(), v.extent = o.grid->extent();
    obstacle_views.push_back(v);
  }

  place_rigids(*this);
  for (auto &set : rigid_sets) {
    facts.rigid_bodies += static_cast<unsigned>(set->defs.size()), facts.rigid_joints += set->njoint;
    if (facts.rigid_hosts.find(set->host_name) == std::string::npos) facts.rigid_hosts += (facts.rigid_hosts.empty() ? "" : ", ") + set->host_name;
    facts.offered.push_back({"two_way_rigid", "rigid host " + set->host_name});
  }

  // Pairs: filters, then laws. The default law is made only when a pair needs it.
  const uint64_t filter_version = filter.version;   // rises, so that lists made under older rules are renewed
  filter = PairFilter(memory());
  filter.version = filter_version + 1;
  pair_law.assign(size_t(nb) * width, 0);
  zone_table.clear(), zone_law.clear();
  std::vector<uint32_t> used;
  for (uint32_t i = 0; i < nb; ++i) {
    const PairSide a{bodies[i]->name, {}, bodies[i]->material};
    for (uint32_t j = 0; j < width; ++j) {
      const bool is_body = j < nb;
      if (is_body && j == i) continue;
      const uint64_t id = is_body ? bodies[j]->id : obstacles[j - nb]->id;
      const PairSide b = is_body ? PairSide{bodies[j]->name, {}, bodies[j]->material} : PairSide{obstacles[j - nb]->name, {}, obstacles[j - nb]->material};
      bool touch = is_body ? (bodies[i]->category & bodies[j]->collides_with) && (bodies[j]->category & bodies[i]->collides_with)
                           : (bodies[i]->category & obstacles[j - nb]->def.collides_with) &&
                                 (obstacles[j - nb]->def.category & bodies[i]->collides_with);
      if (const FilterRule *rule = best_rule(filters, a, b)) {
        if (!is_body || i < j) filter.set(bodies[i]->id, id, !is_body, rule->collide);
        touch = rule->collide;
      }
      if (!is_body && obstacle_views[j - nb].shape == Shape::none) touch = false;
      if (!touch) continue;
      if (is_body) facts.body_pairs += i < j;
      else ++facts.obstacle_pairs;
      find_law(i, j, used);
      for (uint32_t law : used) offer(*laws[law]->type, facts.offered);
    }
  }
  keep_overlaps_aside(*this);
  facts.effects_listed = def.effects != nullptr;
  facts.asked = asked_effects;
  choose_self_bodies(*this, facts, used);
  law_list.clear();
  for (auto &l : laws) law_list.push_back(l.get());

  for (const dfm_type *t : context->registry.list()) offer(*t, facts.available);
  facts.unguarded = def.flags & DFM_WORLD_UNGUARDED;
  facts.available.push_back({kSelfContact, "contact"});
  if (nb && facts.effects_listed) facts.offered.push_back({kSelfContact, "contact"});
  plan = make_plan(facts);

  // While contacts live it only falls: a larger one would turn their rest into a depth, and push them apart at 0.1 d_c / h.
  const double wanted = contact_offset(*this);
  const double before = offset;
  offset = restored ? restored->offset : def.contact_offset > 0 ? def.contact_offset : store.n > 0 ? std::min(offset, wanted) : wanted;
  if (!restored) check_offset(*this);
  for (auto &b : bodies)
    if (def.sleep && b->anchor.empty()) b->anchor = b->p.x;
  active.reserve(nb), sinks.reserve(nb);
  reserve_sleep(nb);
  if (sleepers > 0 && offset != before) wake_all();   // contacts rest at another distance now
  gather_active();
  gravity = load3(def.gravity);
  if (!gravity_keys.empty()) gravity = vector_at(gravity_keys, time);
  bound_age = kNone;
  free_kinetic.resize(nb);
  if (!restored) forget_energy(*this);
  else gravity = restored->gravity, stable = restored->stable, inverted = restored->inverted, bound_age = restored->bound_age;
  guard.forget();
  changed = false;
  settle_overlaps(*this);
}

}  // namespace dfm
