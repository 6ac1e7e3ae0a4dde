#include "plan/plan.h"

#include <algorithm>

#include "core/error.h"
#include "core/lists.h"

namespace dfm {

void plan_effects(const SceneFacts &f, Plan &plan) {
  auto provider = [](const std::vector<SceneFacts::Provider> &list, const std::string &effect) {
    std::vector<std::string> names;
    for (const auto &p : list)
      if (p.effect == effect && std::find(names.begin(), names.end(), p.plugin) == names.end())
        names.push_back(p.plugin);
    return join(names);
  };
  std::vector<std::string> names;
  if (f.effects_listed) {
    names = f.requested;
  } else {
    for (const auto &p : f.offered) names.push_back(p.effect);
    sort_unique(names);
  }
  for (const auto &name : names) {
    const std::string by = provider(f.offered, name);
    if (const std::string idle = provider(f.idle, name); by.empty() && !idle.empty())
      fail(DFM_E_ARG,
           "effect '%s' is asked for, and %s provides it, but the parameters switch it off everywhere; set "
           "them ('deform plugin info %s' lists them) or remove the effect from the list",
           name.c_str(), idle.c_str(), idle.c_str());
    if (by.empty()) {
      const std::string could = provider(f.available, name);
      if (f.bodies == 0 && !could.empty()) {  // an empty world: later bodies may provide it
        plan.effects.push_back({name, "effects", ""});
        continue;
      }
      fail(DFM_E_ARG, "effect '%s' is asked for, but nothing in the scene provides it; %s", name.c_str(),
           could.empty() ? "no loaded plugin could" : ("these loaded plugins could: " + could).c_str());
    }
    plan.effects.push_back({name, f.effects_listed ? "effects" : "content", by});
  }
  const auto listed = [&](const PlannedEffect &e) { return e.name == kSelfContact; };
  if (f.self_bodies == 0 || std::any_of(plan.effects.begin(), plan.effects.end(), listed)) return;
  const std::string by = self_requested_by(f);
  plan.effects.push_back({kSelfContact, by.empty() ? "contact.filter" : by, "contact"});
}

std::string self_requested_by(const SceneFacts &f) {
  const auto listed = [&](const std::string &name) {
    return std::find(f.requested.begin(), f.requested.end(), name) != f.requested.end();
  };
  if (f.effects_listed && listed(kSelfContact)) return "effects";
  if (f.self) return "contact.self";
  for (const char *need : kNeedSelf) {
    const auto offers = [&](const SceneFacts::Provider &p) { return p.effect == need; };
    if (f.effects_listed ? listed(need) : std::any_of(f.offered.begin(), f.offered.end(), offers))
      return need;
  }
  if (f.self_cut) return "a cut";
  return {};
}

bool Plan::has(StageRole role) const {
  return std::any_of(stages.begin(), stages.end(), [&](const PlannedStage &s) { return s.role == role; });
}

}  // namespace dfm
