#include "plan/plan.h"

#include <algorithm>

#include "core/error.h"

namespace dfm {
namespace {

std::string count(unsigned n, const char *noun, const char *plural) { return std::to_string(n) + " " + (n == 1 ? noun : plural); }

void plan_effects(const SceneFacts &f, Plan &plan) {
  auto provider = [](const std::vector<SceneFacts::Provider> &list, const std::string &effect) {
    std::vector<std::string> names;
    for (const auto &p : list)
      if (p.effect == effect && std::find(names.begin(), names.end(), p.plugin) == names.end()) names.push_back(p.plugin);
    return join(names);
  };
  std::vector<std::string> names;
  if (f.effects_listed) {
    names = f.asked;
  } else {
    for (const auto &p : f.offered) names.push_back(p.effect);
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
  }
  for (const auto &name : names) {
    const std::string by = provider(f.offered, name);
    if (const std::string idle = provider(f.idle, name); by.empty() && !idle.empty())
      fail(DFM_E_ARG, "effect '%s' is asked for, and %s provides it, but the parameters of every body leave it off; set them "
           "('deform plugin info %s' lists them) or take the effect from the list", name.c_str(), idle.c_str(), idle.c_str());
    if (by.empty()) {
      const std::string could = provider(f.available, name);
      if (f.bodies == 0 && !could.empty()) {   // an empty world: whoever comes first may provide it
        plan.effects.push_back({name, "effects", ""});
        continue;
      }
      fail(DFM_E_ARG, "effect '%s' is asked for, but nothing in the scene provides it; %s", name.c_str(),
           could.empty() ? "no loaded plugin could" : ("these loaded plugins could: " + could).c_str());
    }
    plan.effects.push_back({name, f.effects_listed ? "effects" : "content", by});
  }
}

}  // namespace

const char *stage_name(StageId id) {
  switch (id) {
    case StageId::motion: return "motion";
    case StageId::model: return "model";
    case StageId::predict: return "predict";
    case StageId::gather: return "gather";
    case StageId::broad: return "broad";
    case StageId::narrow: return "narrow";
    case StageId::solve: return "contact+friction";
    case StageId::distribute: return "distribute";
    case StageId::commit: return "commit";
    case StageId::rigid_predict: return "rigid predict";
    case StageId::rigid_commit: return "rigid commit";
    case StageId::sleep: return "sleep";
    case StageId::step: return "step";
  }
  return "?";
}

bool Plan::touches() const {
  return std::any_of(stages.begin(), stages.end(), [](const PlannedStage &s) { return s.id == StageId::solve; });
}

Plan make_plan(const SceneFacts &f) {
  Plan plan;
  plan_effects(f, plan);
  auto run = [&](StageId id, std::string why) { plan.stages.push_back({id, std::move(why)}); };
  auto leave = [&](const char *name, std::string why) { plan.absent.push_back({name, std::move(why)}); };

  if (f.gravity_keys || f.loads_vary || f.held_move || f.obstacles_move) {
    std::vector<std::string> what;
    if (f.gravity_keys) what.push_back("gravity varies");
    if (f.loads_vary) what.push_back("loads vary");
    if (f.held_move) what.push_back("held points move");
    if (f.obstacles_move) what.push_back("obstacles move");
    run(StageId::motion, join(what));
  } else {
    leave("motion", "nothing is prescribed over time");
  }
  if (f.bodies > f.self_stepping) run(StageId::model, "internal forces of " + count(f.bodies - f.self_stepping, "body", "bodies"));
  if (f.bodies) run(StageId::predict, "velocities without contact of " + count(f.bodies, "body", "bodies"));
  const std::string rigids =
      count(f.rigid_bodies, "rigid body", "rigid bodies") + " and " + count(f.rigid_joints, "joint", "joints") + " of host " + f.rigid_hosts;
  if (f.rigid_bodies) run(StageId::rigid_predict, rigids);
  else leave("rigid", "no rigid bodies");
  const unsigned pairs = f.body_pairs + f.obstacle_pairs;
  if (pairs) {
    const std::string who = count(f.body_pairs, "pair of bodies", "pairs of bodies") + " and " +
                            count(f.obstacle_pairs, "pair of body and obstacle", "pairs of body and obstacle") + " may touch";
    const std::string coupled = count(f.coupled_surfels, "surfel", "surfels") + " of " + count(f.coupled, "body", "bodies");
    if (f.coupled) run(StageId::gather, coupled + " hang on several points each");
    else leave("gather", "every surfel is a point of its body");
    run(StageId::broad, who);
    run(StageId::narrow, who);
    run(StageId::solve, who);
    if (f.rigid_bodies) run(StageId::rigid_commit, "ends of " + rigids);
    run(StageId::distribute, who);
  } else {
    const std::string why = f.bodies < 2 && !f.obstacles ? "one body and nothing to touch" : "filters let no pair touch";
    for (StageId id : {StageId::gather, StageId::broad, StageId::narrow, StageId::solve, StageId::distribute}) leave(stage_name(id), why);
  }
  if (f.rigid_bodies && !pairs) run(StageId::rigid_commit, "ends of " + rigids);
  if (f.bodies) run(StageId::commit, "positions and velocities at the end of the sub-step");
  if (f.bodies && f.sleep) run(StageId::sleep, "islands at rest leave the stages above until something reaches them (contact.sleep)");
  else leave("sleep", f.bodies ? "not asked for (contact.sleep)" : "no body");
  leave("self contact", "not asked for");
  leave("guard", "not available yet: contacts are made from the closest points at the start of each sub-step");
  return plan;
}

}  // namespace dfm
