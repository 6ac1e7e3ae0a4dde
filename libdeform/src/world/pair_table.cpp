// Friction laws of a world's pairs, from the rules by name, group and material.
//
// pair_law holds one law per pair of things. Only where rules tell parts of a surface apart does the pair
// have a table over the zones of both sides as well, and only then is a contact asked which triangle it
// stands on: a world without such rules runs no instruction of it.
#include <algorithm>
#include <cmath>

#include "friction/pair_rules.h"
#include "world/context.h"
#include "world/stages.h"
#include "world/world.h"

namespace dfm {
namespace {

const SurfaceZones::Zone &zone_at(const World &w, uint32_t thing, uint32_t zone) {
  const uint32_t nb = static_cast<uint32_t>(w.bodies.size());
  return thing < nb ? w.bodies[thing]->zones.list[zone] : w.obstacles[thing - nb]->zone;
}

uint32_t zone_count(const World &w, uint32_t thing) {
  return thing < w.bodies.size() ? static_cast<uint32_t>(w.bodies[thing]->zones.list.size()) : 1;
}

const std::string &name_of(const World &w, uint32_t thing) {
  const size_t nb = w.bodies.size();
  return thing < nb ? w.bodies[thing]->name : w.obstacles[thing - nb]->name;
}

// No rule: Coulomb's law with the geometric mean of the two materials' coefficients (doc/decisions/0014).
uint32_t default_law(World &w, double a, double b) {
  const double mu = std::sqrt(a * b);
  const dfm_param_value values[] = {{"mu_C", &mu, 1}, {"mu_S", &mu, 1}};
  const bool plain = a == kDefaultFriction && b == kDefaultFriction;
  const uint32_t law = w.add_law("coulomb", std::span(values, plain ? 0 : 2));
  w.laws[law]->by_default = true;
  return law;
}

const FrictionRule *rule_of(const World &w, uint32_t a, const SurfaceZones::Zone &za, uint32_t b,
                            const SurfaceZones::Zone &zb) {
  return best_rule(w.friction, {name_of(w, a), za.group, za.material},
                   {name_of(w, b), zb.group, zb.material});
}

// On which zones of its two sides a contact stands.
struct Zones { uint32_t a, b; };
Zones zones_of(const World &w, const ContactPoint &c) {
  const Vec3 normal = load3(c.normal);
  const auto zone = [](const Body &b, uint8_t type, uint32_t feature, Vec3 outward) {
    return b.zones.of.empty() ? 0 : zone_of(b.surface, b.zones.of, type, feature, outward);
  };
  const uint32_t a = zone(*w.bodies[c.slot_a], c.type_a, c.feature_a, -normal);
  return {a, c.obstacle ? 0 : zone(*w.bodies[c.slot_b], c.kind == kEdgeEdge ? 1 : 2, c.feature_b, normal)};
}

// Place among bodies and obstacles, or kNone.
uint32_t thing_of(const World &w, uint64_t id) {
  const auto is = [id](const auto &thing) { return thing->id == id; };
  if (const auto b = std::find_if(w.bodies.begin(), w.bodies.end(), is); b != w.bodies.end())
    return static_cast<uint32_t>(b - w.bodies.begin());
  const auto o = std::find_if(w.obstacles.begin(), w.obstacles.end(), is);
  return o == w.obstacles.end() ? kNone
                                : static_cast<uint32_t>(w.bodies.size() + size_t(o - w.obstacles.begin()));
}

}  // namespace

uint32_t World::law_of(uint32_t slot_a, bool obstacle, uint32_t slot_b) const {
  const size_t width = bodies.size() + obstacles.size();
  return pair_law[slot_a * width + (obstacle ? bodies.size() : 0) + slot_b];
}

uint32_t World::resolve_law(uint32_t a, uint32_t zone_a, uint32_t b, uint32_t zone_b) {
  const SurfaceZones::Zone &za = zone_at(*this, a, zone_a), &zb = zone_at(*this, b, zone_b);
  const FrictionRule *const rule = rule_of(*this, a, za, b, zb);
  return rule ? rule->law : default_law(*this, za.friction, zb.friction);
}

void World::find_law(uint32_t a, uint32_t b, std::vector<uint32_t> &used) {
  const size_t width = bodies.size() + obstacles.size();
  const uint32_t na = zone_count(*this, a), nb = zone_count(*this, b);
  std::vector<uint32_t> laws_of;
  bool same = true;
  for (uint32_t i = 0; i < na; ++i)
    for (uint32_t j = 0; j < nb; ++j) {
      laws_of.push_back(resolve_law(a, i, b, j));
      same = same && laws_of.back() == laws_of[0];
    }
  pair_law[a * width + b] = laws_of[0];
  used.assign(laws_of.begin(), same ? laws_of.begin() + 1 : laws_of.end());
  if (same) return;
  if (zone_table.empty()) zone_table.assign(bodies.size() * width, kNone);
  zone_table[a * width + b] = static_cast<uint32_t>(zone_law.size());
  zone_law.insert(zone_law.end(), laws_of.begin(), laws_of.end());
}

void set_zone_laws(World &w, StepContext &step) {
  const size_t nb = w.bodies.size(), width = nb + w.obstacles.size();
  for (uint32_t i = 0; i < step.contacts.size(); ++i) {
    const ContactPoint &c = step.contacts[i];
    const uint32_t table = w.zone_table[c.slot_a * width + (c.obstacle ? nb : 0) + c.slot_b];
    if (table == kNone) continue;
    const Zones zones = zones_of(w, c);
    step.state.law[i] =
        w.zone_law[table + zones.a * (c.obstacle ? 1 : w.bodies[c.slot_b]->zones.list.size()) + zones.b];
  }
}

void rename_law(World &w, const FrictionRule &rule, uint32_t to) {
  ContactStore &s = w.store;
  for (uint32_t m = 0; m < s.n; ++m) {
    if (s.law[m] != rule.law) continue;
    const uint32_t a = thing_of(w, s.id_a[m]), b = thing_of(w, s.id_b[m]);
    if (a == kNone || b == kNone) continue;
    // Nothing is reported after a restore, until the next step.
    const Zones zones = m < w.report.n ? zones_of(w, w.report.contacts[m]) : Zones{0, 0};
    if (rule_of(w, a, zone_at(w, a, zones.a), b, zone_at(w, b, zones.b)) == &rule) s.law[m] = to;
  }
}

}  // namespace dfm
