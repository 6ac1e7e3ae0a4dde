#include "deform/contact.h"

#include <algorithm>
#include <cmath>

#include "api/objects.h"
#include "dynamics/rigid/rigid_set.h"
#include "friction/laws.h"
#include "friction/pair_rules.h"
#include "state/obstacle.h"
#include "step/sides.h"
#include "step/stages.h"
#include "step/step_impulses.h"
#include "world/friction_rules.h"
#include "world/measure.h"

using namespace dfm;

namespace {

// Names of the groups of a body's surface, in the order of their first triangles.
std::vector<std::string> groups_of(const Body &b) {
  std::vector<std::string> out;
  for (const auto &zone : b.zones.list)
    if (!zone.group.empty() && std::find(out.begin(), out.end(), zone.group) == out.end())
      out.push_back(zone.group);
  return out;
}

// "body:GROUP", or an empty string if the text does not name a group of a body.
std::string group_side(World &w, const std::string &text) {
  for (size_t colon = text.find(':'); colon != std::string::npos; colon = text.find(':', colon + 1)) {
    const std::string name = text.substr(0, colon), group = text.substr(colon + 1);
    if (w.find_obstacle(name))
      fail(DFM_E_ARG, "'%s': obstacle '%s' has no surface groups; name the whole obstacle", text.c_str(),
           name.c_str());
    const Body *const b = w.find_body(name);
    if (!b) continue;
    const std::vector<std::string> known = groups_of(*b);
    if (std::find(known.begin(), known.end(), group) != known.end()) return text;
    fail(DFM_E_ARG, "'%s': no triangle of the surface of '%s' is in a group '%s'%s; %s", text.c_str(),
         name.c_str(), group.c_str(), did_you_mean(group, known, '\'').c_str(),
         known.empty() ? "it has no groups" : ("groups: " + join(known)).c_str());
  }
  return {};
}

// A side of a rule: "*", a body or obstacle, "material=NAME", "body:GROUP".
std::string side(World &w, const char *text, bool grouped) {
  need(text, "between");
  const std::string s = text;
  if (s == "*" || w.find_body(s) || w.find_obstacle(s)) return s;
  std::vector<std::string> names{"*"};
  for (auto &b : w.bodies) names.push_back(b->name);
  for (auto &o : w.obstacles) names.push_back(o->name);
  for (auto &m : w.materials) {
    if (m->name.empty()) continue;
    names.push_back(std::string(kMaterialPrefix) + m->name);
    if (names.back() == s) return s;
  }
  if (const std::string found = group_side(w, s); !found.empty()) {
    if (!grouped)
      fail(DFM_E_UNSUPPORTED,
           "'%s': groups of a surface choose friction, not whether it touches; name the whole body", text);
    return found;
  }
  const std::vector<std::string> given(names.begin() + 1, names.end());  // "*" is near any short name
  const std::string near = did_you_mean(s, given, '\'');
  fail(DFM_E_ARG, "'%s' is not a body, obstacle or material of this world%s", text,
       near.empty() ? ("; known: " + join(names)).c_str() : near.c_str());
}

// Seen from the other side the normal and the first tangent are the opposite ones, and the second tangent,
// their product, stays: forces, slips and deflections change their sign along it alone.
dfm_contact report(const World &w, const ContactStore &s, uint32_t i) {
  const bool rigid = &s == &w.tool_store, turned = b_first(w, s, i);
  const double side = turned ? -1 : 1;
  const uint64_t a = turned ? s.id_b[i] : s.id_a[i], b = turned ? s.id_a[i] : s.id_b[i];
  const Obstacle *const obstacle = w.obstacle(b);
  dfm_contact out{};
  if (s.sticks[i]) out.flags |= DFM_CONTACT_STICKING;
  if (s.began[i]) out.flags |= DFM_CONTACT_BEGAN;
  if (s.type_a[i] == 1) out.flags |= DFM_CONTACT_EDGE_A;
  if (s.type_a[i] == 2) out.flags |= DFM_CONTACT_TRIANGLE_A;
  out.body_a = w.handle_of(a);
  out.body_b = obstacle && !obstacle->rigid ? 0 : w.handle_of(b);
  out.key = s.key[i];
  out.feature_a = rigid ? obstacle_slot_of(w, a) : s.feature_a[i];
  out.feature_b = obstacle ? obstacle_slot_of(w, b) : s.feature_b[i];
  out.kind = rigid              ? DFM_CONTACT_RIGID
             : obstacle         ? DFM_CONTACT_PRIMITIVE
             : s.type_b[i] == 1 ? DFM_CONTACT_EDGE_EDGE
                                : DFM_CONTACT_VERTEX_FACE;
  out.law = s.law[i];
  std::copy_n(&s.point[size_t(3) * i], 3, out.point);
  store3(out.normal, side * load3(&s.normal[size_t(3) * i]));
  store3(out.tangent, side * load3(&s.tangent[size_t(3) * i]));
  out.gap = s.gap[i];
  out.area = rigid ? 0 : s.area[i];
  out.fn = s.impulse[size_t(3) * i] / s.h;
  for (size_t k = 0; k < 2; ++k) {
    out.ft[k] = s.impulse[size_t(3) * i + 1 + k] / s.h;
    out.slip[k] = s.slip[size_t(2) * i + k];
  }
  for (uint32_t k = 0; k < std::min({2u, s.nstate, w.laws[s.law[i]]->nstate}); ++k)
    out.bristle[k] = s.bristle[size_t(s.nstate) * i + k];
  for (double *const along : {&out.ft[1], &out.slip[1], &out.bristle[1]}) *along *= side;
  return out;
}

// The center of mass at the time of the contact points: at the start of the sub-step, of h s.
Vec3 center_of(const World &w, uint64_t id, double h) {
  if (Body *const b = w.body(id)) {
    b->dynamics->see_points();
    const CenterMotion now = center_motion(*b);
    return now.place - h * now.velocity;
  }
  const Obstacle &o = *w.obstacle(id);
  if (!o.rigid) return o.pose.position;
  const dfm_rigid_state &s = o.rigid->state[o.rigid_body];
  return load3(s.position) - h * load3(s.velocity);
}

// Resultants on a by id. Pairs are few: rows of a pair follow each other.
struct PairRow {
  uint64_t a, b;  // ids: the order of creation
  Vec3 center;    // of a
  dfm_pair_report report;
};

PairRow &row_of(const World &w, std::vector<PairRow> &pairs, uint64_t a, uint64_t b, uint32_t law, double h) {
  auto at = std::lower_bound(pairs.begin(), pairs.end(), std::pair(a, b),
                             [](const PairRow &p, auto &k) { return std::pair(p.a, p.b) < k; });
  if (at == pairs.end() || at->a != a || at->b != b) {
    dfm_pair_report p{};
    p.a = w.handle_of(a);
    p.b = w.handle_of(b);
    p.law = law;
    for (const PairWork &work : w.work)
      if ((work.a == a && work.b == b) || (work.a == b && work.b == a)) p.friction_work += work.friction;
    const bool known = at != pairs.begin() && at[-1].a == a;
    at = pairs.insert(at, {a, b, known ? at[-1].center : center_of(w, a, h), p});
  }
  return *at;
}

void add_pairs(const World &w, const ContactStore &s, std::vector<PairRow> &pairs) {
  for (uint32_t i = 0; i < s.n; ++i) {
    if (!s.touching[i]) continue;
    const PairSides sides = pair_sides(w, s, i);
    PairRow &row = row_of(w, pairs, sides.a, sides.b, s.law[i], s.h);
    dfm_pair_report &p = row.report;
    const double scale = (sides.turned ? -1 : 1) / s.h, load = s.impulse[size_t(3) * i];
    const Vec3 force = scale * s.world_impulse(i);
    ++p.count;
    p.sticking += s.sticks[i];
    p.normal += load / s.h;
    if (sides.a != sides.b) {  // forces of a body on itself sum to zero
      add3(p.force, force);
      add3(p.friction, scale * s.friction_impulse(i));
      add3(p.moment, cross(load3(&s.point[size_t(3) * i]) - row.center, force));
    }
    const double *const slip = &s.slip[size_t(2) * i];
    if (load > 0) p.slip_max = std::max(p.slip_max, std::sqrt(slip[0] * slip[0] + slip[1] * slip[1]));
  }
}

// The values of a def; `what` names them in the error if they are missing.
std::span<const dfm_param_value> values_of(const dfm_params &params, const char *what) {
  if (params.n && !params.values)
    fail(DFM_E_ARG, "%u parameters are announced for %s, but params.values is NULL", params.n, what);
  return {params.values, params.n};
}

}  // namespace

dfm_status dfm_world_add_friction(dfm_world world, const dfm_friction_def *given) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    need(given, "def");
    const dfm_friction_def def = take_def(given, dfm_friction_def{});
    check_flags(def, DFM_FRICTION_RESTITUTION, "dfm_friction_def");
    need(def.law, "law");
    double restitution = kNoRestitution;
    if (def.flags & DFM_FRICTION_RESTITUTION) {
      restitution = def.restitution;
      if (!(restitution >= 0 && restitution <= 1))
        fail(DFM_E_ARG, "restitution is %g; give a number from 0 to 1", restitution);
    }
    const auto values = values_of(def.params, ("law '" + std::string(def.law) + "'").c_str());
    add_friction_rule(w, side(w, def.between[0], true), side(w, def.between[1], true), def.law, values,
                      restitution);
  });
}

dfm_status dfm_world_set_friction(dfm_world world, const char *a, const char *b, const dfm_params *params) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    need(a, "a");
    need(b, "b");
    need(params, "params");
    set_friction_rule(w, a, b, values_of(*params, "a rule of friction"));
  });
}

dfm_status dfm_world_remove_friction(dfm_world world, const char *a, const char *b) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    need(a, "a");
    need(b, "b");
    remove_friction_rule(w, a, b);
  });
}

dfm_status dfm_world_filter_pair(dfm_world world, const char *a, const char *b, bool collide) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    FilterRule rule{{side(w, a, false), side(w, b, false)}, collide};
    const auto there =
        std::ranges::find_if(w.filters, [&](auto &r) { return same_pair(r.between, rule.between); });
    // and no newer one that could decide otherwise
    if (there != w.filters.end() &&
        std::all_of(there, w.filters.end(), [&](auto &r) { return r.collide == collide; }))
      return;
    add_rule(w.filters, std::move(rule));
    if (collide) w.overlaps.all = true;
    wake_all(w);
    w.changed = true;
  });
}

dfm_status dfm_world_remove_filter(dfm_world world, const char *a, const char *b) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    need(a, "a");
    need(b, "b");
    const std::string between[2] = {a, b};
    const auto rule = std::find_if(w.filters.begin(), w.filters.end(),
                                   [&](const FilterRule &r) { return same_pair(r.between, between); });
    if (rule == w.filters.end())
      fail(DFM_E_ARG, "there is no filter for ['%s', '%s']; create one with dfm_world_filter_pair", a, b);
    if (!rule->collide) w.overlaps.all = true;
    w.filters.erase(rule);
    wake_all(w);
    w.changed = true;
  });
}

dfm_status dfm_world_contacts_sized(dfm_world world, uint32_t row_size, uint32_t capacity, dfm_contact *out,
                                    uint32_t *n) {
  return as_status([&] {
    Rows<dfm_contact> rows(out, row_size, "dfm_contact");
    const World &w = not_in_step(world_of(world));
    const auto count = size_t(std::count(w.store.touching.begin(), w.store.touching.end(), 1));
    if (!room(count + w.tool_store.n, capacity, out, n)) return;
    for (const ContactStore *const s : {&w.store, &w.tool_store})
      for (const uint32_t i : s->by_key)
        if (s->touching[i]) rows.add(report(w, *s, i));
  });
}

dfm_status dfm_world_law_info(dfm_world world, uint32_t law, dfm_law_info *info) {
  return as_status(to_read<world_of>, world, [&](const World &w) {
    if (law >= w.laws.size())
      fail(DFM_E_ARG,
           "there is no law %u in this world, which has %zu; take the number from a dfm_contact or a "
           "dfm_pair_report",
           law, w.laws.size());
    const LawInstance &l = *w.laws[law];
    dfm_law_info out{};
    out.id = l.type->id;
    out.name = l.type->name;
    out.type = l.type;
    out.params = {sizeof(dfm_params), static_cast<uint32_t>(l.by_key.size()), l.by_key.data()};
    copy_out(info, out);
  });
}

dfm_status dfm_world_pairs_sized(dfm_world world, uint32_t row_size, uint32_t capacity, dfm_pair_report *out,
                                 uint32_t *n) {
  return as_status([&] {
    Rows<dfm_pair_report> rows(out, row_size, "dfm_pair_report");
    World &w = not_in_step(world_of(world));
    std::vector<PairRow> pairs;
    for (const ContactStore *const s : {&w.store, &w.tool_store}) add_pairs(w, *s, pairs);
    if (!room(pairs.size(), capacity, out, n)) return;
    for (const PairRow &p : pairs) rows.add(p.report);
  });
}

dfm_status dfm_world_pair_wrench(dfm_world world, uint64_t a, uint64_t b, const double point[3],
                                 double force[3], double moment[3]) {
  return as_status(to_read<world_of>, world, [&](const World &w) {
    need(point, "point");
    if (!all_finite(point, 3)) fail(DFM_E_ARG, "the point about which the moment is taken is not finite");
    const uint64_t ia = id_of(w, a, "a"), ib = id_of(w, b, "b");
    const Vec3 about = load3(point);
    Vec3 sum, turn;
    for (const ContactStore *const list : {&w.store, &w.tool_store})
      for (uint32_t i = 0; i < list->n; ++i) {
        const ContactStore &s = *list;
        const bool straight = s.id_a[i] == ia && s.id_b[i] == ib, turned = s.id_a[i] == ib && s.id_b[i] == ia;
        if (!s.touching[i] || straight == turned) continue;
        const Vec3 one = ((turned ? -1 : 1) / s.h) * s.world_impulse(i);
        sum += one;
        turn += cross(load3(&s.point[size_t(3) * i]) - about, one);
      }
    if (force) store3(force, sum);
    if (moment) store3(moment, turn);
  });
}

dfm_status dfm_world_pair_impulses_sized(dfm_world world, uint32_t row_size, uint32_t capacity,
                                         dfm_pair_impulse *out, uint32_t *n) {
  return as_status([&] {
    Rows<dfm_pair_impulse> rows(out, row_size, "dfm_pair_impulse");
    const World &w = not_in_step(world_of(world));
    Array<StepImpulses::Pair> pairs(w.memory());
    list_impulses(w, pairs);
    if (!room(pairs.size(), capacity, out, n)) return;
    for (const StepImpulses::Pair &p : pairs) {
      dfm_pair_impulse r{};
      r.a = w.handle_of(p.a);
      r.b = w.handle_of(p.b);
      store3(r.impulse, p.impulse);
      store3(r.point, (1 / p.normal) * p.place);
      r.normal_impulse = p.normal;
      r.peak_normal = p.peak_normal;
      r.peak_force = p.peak_force;
      r.touching = p.touching;
      std::copy_n(p.part, StepImpulses::kParts, r.part);
      rows.add(r);
    }
  });
}

dfm_status dfm_world_events_sized(dfm_world world, uint32_t row_size, uint32_t capacity,
                                  dfm_contact_event *out, uint32_t *n) {
  return as_status([&] {
    Rows<dfm_contact_event> rows(out, row_size, "dfm_contact_event");
    World &w = exclusive(world_of(world));
    if (!room(w.events.size(), capacity, out, n)) return;
    for (const dfm_contact_event &e : w.events) rows.add(e);
    w.events.clear();
  });
}

dfm_status dfm_world_hold_begin(dfm_world world) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    w.hold.on = true;
    w.hold.start = w.time;
    std::fill(w.store.held.begin(), w.store.held.end(), uint8_t(0));
    std::fill(w.store.path.begin(), w.store.path.end(), 0.0);
    hold_sleepers(w);
  });
}

dfm_status dfm_world_hold(dfm_world world, double *creep, uint32_t *count) {
  return as_status(to_read<world_of>, world, [&](const World &w) {
    need(creep, "creep");
    double longest = 0;
    uint32_t n = 0;
    for (uint32_t i = 0; i < w.store.n; ++i) {
      if (!w.store.held[i]) continue;
      ++n;
      const double *const p = &w.store.path[size_t(2) * i];
      longest = std::max(longest, std::sqrt(p[0] * p[0] + p[1] * p[1]));
    }
    *creep = w.hold.on && n && w.time > w.hold.start ? longest / (w.time - w.hold.start) : NAN;
    if (count) *count = n;
  });
}
