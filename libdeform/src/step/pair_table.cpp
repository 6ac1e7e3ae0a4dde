// Friction laws of a world's pairs, from the rules by name, group and material.
//
// PairTables::law holds one law per pair of things. Only if rules distinguish parts of a surface does the
// pair also have a table over the zones of both sides, and only then is the triangle of a contact looked up:
// a world without such rules runs no instruction of it.
#include <algorithm>
#include <cmath>

#include "plugin/context.h"
#include "plugin/params.h"
#include "state/partner.h"
#include "step/context.h"
#include "step/pair_table.h"

namespace dfm {
namespace {

const SurfaceZones::Zone &zone_at(const World &w, uint32_t thing, uint32_t zone) {
  const uint32_t nb = static_cast<uint32_t>(w.bodies.size());
  return thing < nb ? w.bodies[thing]->zones.list[zone] : w.obstacles[thing - nb]->zone;
}

uint32_t zone_count(const World &w, uint32_t thing) {
  return thing < w.bodies.size() ? static_cast<uint32_t>(w.bodies[thing]->zones.list.size()) : 1;
}

PairSide side_of(const World &w, uint32_t thing, const SurfaceZones::Zone &zone) {
  const PairSide whole = partner_of(w, thing).side;
  return {whole.name, zone.group, zone.material, whole.whole};
}

// No rule: Coulomb's law with the geometric mean of the two materials' coefficients.
uint32_t default_law(World &w, double a, double b) {
  const double mu = std::sqrt(a * b);
  const dfm_param_value values[] = {{"mu_C", &mu, 1}, {"mu_S", &mu, 1}};
  const bool plain = a == kDefaultFriction && b == kDefaultFriction;
  const uint32_t law = add_law(w, "coulomb", std::span(values, plain ? 0 : 2));
  w.laws[law]->by_default = true;
  return law;
}

const FrictionRule *rule_of(const World &w, uint32_t a, const SurfaceZones::Zone &za, uint32_t b,
                            const SurfaceZones::Zone &zb) {
  return best_rule(w.friction, side_of(w, a, za), side_of(w, b, zb));
}

// The zones of the two sides of a contact.
struct Zones { uint32_t a, b; };
uint32_t zone(const Body &b, uint8_t type, uint32_t feature, Vec3 outward) {
  return b.zones.of.empty() ? 0 : zone_of(b.surface, b.zones.of, type, feature, outward);
}
Zones zones_of(const World &w, const ContactPoint &c) {
  const Vec3 normal = load3(c.normal);
  const uint32_t a = zone(*w.bodies[c.slot_a], c.type_a, c.feature_a, -normal);
  return {a, c.obstacle ? 0 : zone(*w.bodies[c.slot_b], type_b(c), c.feature_b, normal)};
}

// Index among bodies and obstacles, or kNone.
uint32_t thing_of(const World &w, uint64_t id) {
  if (const uint32_t b = slot_of(w, id); b != kNone) return b;
  const uint32_t o = obstacle_slot_of(w, id);
  return o == kNone ? kNone : static_cast<uint32_t>(w.bodies.size()) + o;
}

}  // namespace

uint32_t law_of_zones(World &w, uint32_t a, uint32_t zone_a, uint32_t b, uint32_t zone_b) {
  const SurfaceZones::Zone &za = zone_at(w, a, zone_a), &zb = zone_at(w, b, zone_b);
  const FrictionRule *const rule = rule_of(w, a, za, b, zb);
  return rule ? rule->law : default_law(w, za.friction, zb.friction);
}

uint32_t add_law(World &w, const char *name, std::span<const dfm_param_value> values,
                 std::span<const uint8_t> free, double restitution) {
  const dfm_type &type = w.context->registry.find(DFM_KIND_FRICTION, name);
  std::vector<double> packed = pack_params(type, values);
  for (uint32_t i = 0; i < w.laws.size(); ++i)
    if (w.laws[i]->requested_type == &type && w.laws[i]->requested == packed &&
        w.laws[i]->restitution == restitution)
      return i;
  auto law = make_law(w, type, std::move(packed), restitution);
  for (const LeftOut &o : left_out_of(*law)) warn_of(*w.context, o);
  return place_law(w, std::move(law), free);
}

std::unique_ptr<LawInstance> make_law(const World &w, const dfm_type &type, std::vector<double> requested,
                                      double restitution) {
  SelectedLaw made = select_law(w.context->registry, w.context->host, w.selection, type, requested);
  auto law = std::make_unique<LawInstance>(*made.type, w.context->host, std::move(made.values));
  law->requested_type = &type;
  law->requested = std::move(requested);
  law->restitution = restitution;
  return law;
}

uint32_t place_law(World &w, std::unique_ptr<LawInstance> law, std::span<const uint8_t> free) {
  const auto found = std::find(free.begin(), free.end(), uint8_t(1));
  if (found == free.end()) {
    w.laws.push_back(std::move(law));
    return static_cast<uint32_t>(w.laws.size() - 1);
  }
  const uint32_t place = static_cast<uint32_t>(found - free.begin());
  w.laws[place] = std::move(law);
  w.changed = true;
  return place;
}

void offer_law(const LawInstance &law, SceneFacts &facts) {
  const std::string id = law.type->id;
  if (!is_frictionless(*law.ops)) facts.offered.push_back({kFriction, id});
  for (const LawEffect &e : law_effects(*law.type, *law.host, law.params))
    (e.works ? facts.offered : facts.idle).push_back({e.name, id});
}

uint32_t pair_law(const World &w, uint32_t slot_a, bool obstacle, uint32_t slot_b) {
  const size_t nb = w.bodies.size(), width = nb + w.obstacles.size();
  return w.pairs.law[slot_a * width + (obstacle ? nb : 0) + slot_b];
}

PairLaw find_law(World &w, uint32_t a, uint32_t b, std::vector<uint32_t> &used) {
  const uint32_t na = zone_count(w, a), nb = zone_count(w, b);
  std::vector<uint32_t> laws_of;
  bool same = true;
  for (uint32_t i = 0; i < na; ++i)
    for (uint32_t j = 0; j < nb; ++j) {
      laws_of.push_back(law_of_zones(w, a, i, b, j));
      same = same && laws_of.back() == laws_of[0];
    }
  used.assign(laws_of.begin(), same ? laws_of.begin() + 1 : laws_of.end());
  PairLaw out{laws_of[0]};
  if (!same) {
    out.zones = static_cast<uint32_t>(w.pairs.zone_law.size());
    w.pairs.zone_law.insert(w.pairs.zone_law.end(), laws_of.begin(), laws_of.end());
  }
  put_law(w, a, b, out);
  return out;
}

void put_law(World &w, uint32_t a, uint32_t b, const PairLaw &known) {
  const size_t width = w.bodies.size() + w.obstacles.size();
  PairTables &to = w.pairs;
  to.law[a * width + b] = known.law;
  if (known.zones == kNone) return;
  if (to.zone_table.empty()) to.zone_table.assign(w.bodies.size() * width, kNone);
  to.zone_table[a * width + b] = known.zones;
}

uint32_t contact_law(const World &w, const ContactPoint &c) {
  const size_t nb = w.bodies.size(), width = nb + w.obstacles.size();
  const uint32_t table = w.pairs.zone_table.empty()
                             ? kNone
                             : w.pairs.zone_table[c.slot_a * width + (c.obstacle ? nb : 0) + c.slot_b];
  if (table == kNone) return pair_law(w, c.slot_a, c.obstacle, c.slot_b);
  const Zones zones = zones_of(w, c);
  const size_t others = c.obstacle ? 1 : w.bodies[c.slot_b]->zones.list.size();
  return w.pairs.zone_law[table + zones.a * others + zones.b];
}

void rename_law(World &w, const FrictionRule &rule, uint32_t to) {
  const size_t nb = w.bodies.size();
  for (ContactStore *const s : {&w.tool_store, &w.store})
    for (uint32_t m = 0; m < s->n; ++m) {
      if (s->law[m] != rule.law) continue;
      const uint32_t a = thing_of(w, s->id_a[m]), b = thing_of(w, s->id_b[m]);
      if (a == kNone || b == kNone) continue;
      const Vec3 normal = load3(&s->normal[3 * size_t{m}]);  // rigid things have one zone each
      const auto zone_of_side = [&](uint32_t thing, uint8_t type, uint32_t feature, Vec3 outward) {
        return zone_at(w, thing, thing < nb ? zone(*w.bodies[thing], type, feature, outward) : 0);
      };
      if (rule_of(w, a, zone_of_side(a, s->type_a[m], s->feature_a[m], -normal), b,
                  zone_of_side(b, s->type_b[m], s->feature_b[m], normal)) == &rule)
        s->law[m] = to;
    }
}

}  // namespace dfm
