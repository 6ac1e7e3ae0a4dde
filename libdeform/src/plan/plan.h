// The plan: which stages a sub-step runs, and for which effects, derived from the contents of the scene. A
// stage that is not needed is not in the list, so it costs no instruction; `deform explain` prints both lists
// with reasons. The order of the stages is that of the table (step/step.cpp).
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "plugin/selection.h"

namespace dfm {

// Functions of stages on which other stages depend; most stages have none.
enum class StageRole {
  none,
  lists_pairs,       // candidates of pairs, and how fast surfaces are
  finds_contacts,    // contacts of pairs
  solves,            // contacts act on bodies
  reports_impulses,  // as impulses on points
  guards,            // nothing crosses at the end of the sub-step
};

// Motions and loads that are given over time.
struct Varying {
  bool gravity_keys = false, loads_vary = false, held_move = false, obstacles_move = false;
  bool operator==(const Varying &) const = default;
};

// Input of the plan.
struct SceneFacts : Varying {
  unsigned bodies = 0, self_stepping = 0, obstacles = 0;
  unsigned coupled = 0, coupled_surfels = 0;    // bodies with a surface of their own, and its surfels
  unsigned body_pairs = 0, obstacle_pairs = 0;  // pairs that may touch, filters applied
  unsigned rigid_bodies = 0, rigid_joints = 0;
  unsigned attachments = 0, paid_cuts = 0;  // paid: a tool and a body that takes energy to be cut
  std::string rigid_hosts;                  // names
  unsigned rigid_pairs = 0;  // of rigid bodies of the builtin host, with each other and with obstacles
  bool rigid_rows = false;   // rigid things may touch each other, tools included
  std::vector<std::string> rigid_alone;  // rigid bodies that pass through obstacles
  bool unguarded = false;
  struct Provider {
    std::string effect, plugin;
    bool operator==(const Provider &) const = default;
  };
  // by models and laws of the scene, with their present parameters
  std::vector<Provider> offered;
  // by models and laws of the scene, with suitable parameters
  std::vector<Provider> idle;
  std::vector<Provider> available;  // by every loaded plugin
  bool effects_listed = false;
  bool sleep = false;                  // islands at rest may sleep
  bool self = false;                   // contact.self
  unsigned self_bodies = 0;            // bodies that may touch themselves, filters applied
  bool self_cut = false;               // one of them because it has been cut
  std::vector<std::string> requested;  // where listed
  bool operator==(const SceneFacts &) const = default;
};

// Whether a stage runs, and why; if it does not: why not, or empty if that is obvious.
struct StageChoice {
  bool runs = false;
  std::string why;
};
namespace when {
StageChoice motion(const SceneFacts &facts);
StageChoice model(const SceneFacts &facts);
StageChoice predict(const SceneFacts &facts);
StageChoice rigid_predict(const SceneFacts &facts);
StageChoice gather(const SceneFacts &facts);
StageChoice broad(const SceneFacts &facts);
StageChoice narrow(const SceneFacts &facts);
StageChoice self(const SceneFacts &facts);
StageChoice solve(const SceneFacts &facts);
StageChoice rigid_commit(const SceneFacts &facts);
StageChoice distribute(const SceneFacts &facts);
StageChoice guard(const SceneFacts &facts);
StageChoice commit(const SceneFacts &facts);
StageChoice sleep(const SceneFacts &facts);
bool acts(const SceneFacts &facts);  // whether contact, attachments or blades act on bodies
}  // namespace when

struct PlannedStage {
  size_t row;  // of the table
  StageRole role;
  std::string why;
};
struct AbsentStage { std::string name, why; };
struct PlannedEffect { std::string name, requested_by, provided_by; };

struct Plan {
  std::vector<PlannedStage> stages;  // in the order of a sub-step
  std::vector<AbsentStage> absent;
  std::vector<PlannedEffect> effects;
  bool on_bodies = false;  // its contact solve acts on bodies, not on rigid things alone
  bool has(StageRole role) const;
  bool touches() const { return on_bodies && has(StageRole::solves); }
};

// What calls for self contact: "contact.self", "effects", or the effect that needs it; "" if nothing does.
std::string self_requested_by(const SceneFacts &facts);

// The effects. Throws Error(DFM_E_ARG) if nothing in the scene provides a listed one; names what could.
void plan_effects(const SceneFacts &facts, Plan &plan);

}  // namespace dfm
