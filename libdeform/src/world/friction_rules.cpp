// If only one rule refers to a law, its parameters are replaced: numbers of laws, tables and plan remain
// valid, and contacts keep their state. If several rules share a law, the rule gets a new law.
#include "world/friction_rules.h"

#include <algorithm>

#include "core/error.h"
#include "friction/pair_rules.h"
#include "plugin/context.h"
#include "plugin/params.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/pair_table.h"
#include "step/stages.h"
#include "step/watch/contact_energy.h"

namespace dfm {
namespace {

// Laws to which no rule except `but`, no contact and no pair table refers. New laws may take their places.
std::vector<uint8_t> free_laws(const World &w, const FrictionRule *but) {
  std::vector<uint8_t> free(w.laws.size(), 1);
  const auto use = [&](uint32_t law) {
    if (law < free.size()) free[law] = 0;
  };
  for (const FrictionRule &r : w.friction)
    if (&r != but) use(r.law);
  for (const auto *const list : {&w.pairs.law, &w.pairs.zone_law, &w.pairs.tool_law})
    std::for_each(list->begin(), list->end(), use);
  for (const ContactStore *const store : {&w.store, &w.tool_store})
    std::for_each(store->law.begin(), store->law.end(), use);
  return free;
}

FrictionRule *find_rule(World &w, const std::string between[2]) {
  const auto at = std::find_if(w.friction.begin(), w.friction.end(),
                               [&](const FrictionRule &r) { return same_pair(r.between, between); });
  return at == w.friction.end() ? nullptr : &*at;
}

FrictionRule &need_rule(World &w, const char *a, const char *b) {
  const std::string between[2] = {a, b};
  if (FrictionRule *const rule = find_rule(w, between)) return *rule;
  std::vector<std::string> known;
  for (const FrictionRule &r : w.friction)
    known.push_back("['" + r.between[0] + "', '" + r.between[1] + "']");
  fail(DFM_E_ARG,
       "there is no friction rule for ['%s', '%s'] (rules: %s); create one with dfm_world_add_friction", a, b,
       known.empty() ? "none" : join(known).c_str());
}

bool shared(const World &w, const FrictionRule &rule) {
  const auto refers = [&](const FrictionRule &r) { return &r != &rule && r.law == rule.law; };
  return w.laws[rule.law]->by_default || std::any_of(w.friction.begin(), w.friction.end(), refers);
}

bool same_memory(const LawInstance &a, const LawInstance &b) {
  return a.type == b.type && a.tangent == b.tangent;
}

bool bring_the_same(const LawInstance &a, const LawInstance &b) {
  const std::vector<LawEffect> x = law_effects(*a.type, *a.host, a.params),
                               y = law_effects(*b.type, *b.host, b.params);
  return std::equal(x.begin(), x.end(), y.begin(), y.end(), [](const LawEffect &e, const LawEffect &f) {
    return e.name == f.name && e.works == f.works;
  });
}

// The law of the rule, with other parameter values.
void put_params(World &w, FrictionRule &rule, std::vector<double> values, double restitution) {
  forget_contact_gain(w);
  std::unique_ptr<LawInstance> &law = w.laws[rule.law];
  auto fresh = make_law(w, *law->requested_type, std::move(values), restitution);
  const bool remembers = same_memory(*law, *fresh);
  // the plan names the effects that the parameters call for
  if (!bring_the_same(*law, *fresh)) w.changed = true;
  if (remembers && !shared(w, rule)) {
    law.swap(fresh);
    if (rule.law < w.pairs.laws.size()) w.pairs.laws[rule.law] = law.get();
    return;
  }
  const uint32_t own = place_law(w, std::move(fresh), free_laws(w, nullptr));
  if (remembers) rename_law(w, rule, own);
  rule.law = own;
  w.changed = true;
}

// Whether it applies to one pair of whole things. Then its order among rules of this kind does not matter.
bool names_things(World &w, const FrictionRule &rule) {
  return std::all_of(rule.between, rule.between + 2,
                     [&](const std::string &side) { return w.find_body(side) || w.find_obstacle(side); });
}

// The last one of rules of equal weight wins.
void move_to_end(World &w, FrictionRule *rule) {
  FrictionRule *const end = w.friction.data() + w.friction.size();
  if (std::any_of(rule, end, [&](const FrictionRule &r) { return !names_things(w, r); }) && rule + 1 != end)
    w.changed = true;
  std::rotate(rule, rule + 1, end);
}

}  // namespace

void add_friction_rule(World &w, std::string a, std::string b, const char *law,
                       std::span<const dfm_param_value> given, double restitution) {
  FrictionRule rule{{std::move(a), std::move(b)}, 0};
  w.friction.reserve(w.friction.size() + 1);
  FrictionRule *const before = find_rule(w, rule.between);
  const dfm_type &type = w.context->registry.find(DFM_KIND_FRICTION, law);
  if (before && w.laws[before->law]->requested_type == &type) {
    put_params(w, *before, pack_params(type, given), restitution);
    move_to_end(w, before);
  } else {
    rule.law = add_law(w, law, given, free_laws(w, before), restitution);
    add_rule(w.friction, std::move(rule));
    w.changed = true;
  }
  wake_all(w);
  values_changed(w);
}

void set_friction_rule(World &w, const char *a, const char *b, std::span<const dfm_param_value> given) {
  FrictionRule &rule = need_rule(w, a, b);
  const LawInstance &law = *w.laws[rule.law];
  std::vector<double> values = changed_params(*law.requested_type, given, law.requested);
  if (values == law.requested) return;
  put_params(w, rule, std::move(values), law.restitution);
  wake_all(w);
  values_changed(w);
}

void remove_friction_rule(World &w, const char *a, const char *b) {
  FrictionRule &rule = need_rule(w, a, b);
  w.friction.erase(w.friction.begin() + (&rule - w.friction.data()));
  wake_all(w);
  w.changed = true;
}

}  // namespace dfm
