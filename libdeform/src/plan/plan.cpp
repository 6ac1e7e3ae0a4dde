#include "plan/plan.h"

#include <algorithm>

#include "core/error.h"

namespace dfm {
namespace {

constexpr char kSelfAuto[] = "contact.self auto";

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
  const auto listed = [&](const PlannedEffect &e) { return e.name == kSelfContact; };
  if (f.self_bodies == 0 || std::any_of(plan.effects.begin(), plan.effects.end(), listed)) return;
  const std::string by = self_asked_by(f);
  plan.effects.push_back({kSelfContact, by.empty() ? "contact.filter" : by, "contact"});
}

// Effects that cannot keep their promise without it: what is cut lies on itself, what folds comes to lie on itself.
constexpr const char *kNeedSelf[] = {"cutting", "folding"};

void plan_self(const SceneFacts &f, Plan &plan) {
  const std::string by = self_asked_by(f);
  if (f.self_bodies)
    plan.stages.push_back({StageId::self, count(f.self_bodies, "body", "bodies") + " may touch themselves (" + (by.empty() ? "contact.filter" : by) + ")" +
                                                    (by == kSelfAuto ? ", each only while it folds so far that it may" : "")});
  else
    plan.absent.push_back({"self contact", by.empty() ? "not asked for (contact.self), and no effect needs it" : f.bodies ? "filters take every body out" : "no body"});
}

}  // namespace

std::string self_asked_by(const SceneFacts &f) {
  const auto listed = [&](const std::string &name) { return std::find(f.asked.begin(), f.asked.end(), name) != f.asked.end(); };
  if (f.effects_listed && listed(kSelfContact)) return "effects";
  if (f.self) return "contact.self";
  for (const char *need : kNeedSelf) {
    const auto offers = [&](const SceneFacts::Provider &p) { return p.effect == need; };
    if (f.effects_listed ? listed(need) : std::any_of(f.offered.begin(), f.offered.end(), offers)) return need;
  }
  if (f.self_auto) return kSelfAuto;
  return {};
}

const char *stage_name(StageId id) {
  switch (id) {
    case StageId::motion: return "motion";
    case StageId::model: return "model";
    case StageId::predict: return "predict";
    case StageId::gather: return "gather";
    case StageId::broad: return "broad";
    case StageId::narrow: return "narrow";
    case StageId::self: return "self contact";
    case StageId::solve: return "contact+friction";
    case StageId::distribute: return "distribute";
    case StageId::guard: return "guard";
    case StageId::commit: return "commit";
    case StageId::rigid_predict: return "rigid predict";
    case StageId::rigid_commit: return "rigid commit";
    case StageId::sleep: return "sleep";
    case StageId::lagged: return "lagged friction";
    case StageId::rollback: return "rollback";
    case StageId::step: return "step";
  }
  return "?";
}

bool Plan::has(StageId id) const {
  return std::any_of(stages.begin(), stages.end(), [&](const PlannedStage &s) { return s.id == id; });
}
bool Plan::touches() const { return has(StageId::solve) || has(StageId::rollback); }
bool Plan::rolls_back() const { return has(StageId::rollback); }

Plan make_plan(const SceneFacts &f) {
  if (f.rollback && f.self_bodies)
    fail(DFM_E_UNSUPPORTED, "self contact cannot be in a world whose contact method is rollback (it is there to compare: doc/concepts/rollback.md); use the "
         "method velocity");
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
  if (pairs || f.self_bodies) {
    const std::string who = count(f.body_pairs, "pair of bodies", "pairs of bodies") + " and " +
                            count(f.obstacle_pairs, "pair of body and obstacle", "pairs of body and obstacle") + " may touch";
    const std::string coupled = count(f.coupled_surfels, "surfel", "surfels") + " of " + count(f.coupled, "body", "bodies");
    if (f.coupled) run(StageId::gather, coupled + " hang on several points each");
    else leave("gather", "every surfel is a point of its body");
    if (f.rollback) {
      run(StageId::lagged, "friction that the last sub-step found");
      run(StageId::broad, who);
      run(StageId::rollback, "contact.method rollback: vertices that collide go back to their time of impact; there to compare, not to use");
      for (StageId id : {StageId::narrow, StageId::solve, StageId::distribute}) leave(stage_name(id), "contact.method is rollback");
    } else {
      for (StageId id : {StageId::broad, StageId::narrow})
        if (pairs) run(id, who);
        else leave(stage_name(id), "no pair may touch");
      plan_self(f, plan);
      run(StageId::solve, who);
      if (f.rigid_bodies) run(StageId::rigid_commit, "ends of " + rigids);
      run(StageId::distribute, who);
    }
  } else {
    const std::string why = f.bodies < 2 && !f.obstacles ? "one body and nothing to touch" : "filters let no pair touch";
    for (StageId id : {StageId::gather, StageId::broad, StageId::narrow, StageId::solve, StageId::distribute, StageId::guard}) leave(stage_name(id), why);
    plan_self(f, plan);
  }
  if (f.rigid_bodies && !pairs && !f.self_bodies) run(StageId::rigid_commit, "ends of " + rigids);
  if (f.rollback) leave("guard", "contact.method is rollback");
  else if ((pairs || f.self_bodies) && !f.unguarded)
    run(StageId::guard, "nothing crosses at the end of a sub-step: " + count(pairs, "pair", "pairs") +
                            (f.self_bodies ? ", " + count(f.self_bodies, "body with itself", "bodies with themselves") : ""));
  else if (pairs || f.self_bodies) leave("guard", "switched off (contact.guard): what moves further than contacts reach in one sub-step may cross");
  if (f.bodies) run(StageId::commit, "positions and velocities at the end of the sub-step");
  if (f.bodies && f.sleep) run(StageId::sleep, "islands at rest leave the stages above until something reaches them (contact.sleep)");
  else leave("sleep", f.bodies ? "not asked for (contact.sleep)" : "no body");
  return plan;
}

}  // namespace dfm
