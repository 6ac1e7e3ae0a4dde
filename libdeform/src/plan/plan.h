// The plan: which stages a sub-step runs, derived from what the scene contains. A stage that nothing calls for is not in the list, so it
// costs no instruction; `deform explain` prints both lists with the reasons.
#pragma once
#include <string>
#include <vector>

namespace dfm {

enum class StageId {
  motion, model, predict, gather, broad, narrow, self, solve, distribute, guard, commit, rigid_predict, rigid_commit, sleep, lagged, rollback, step
};
const char *stage_name(StageId id);

// What the plan is derived from.
struct SceneFacts {
  unsigned bodies = 0, self_stepping = 0, obstacles = 0;
  unsigned coupled = 0, coupled_surfels = 0;           // bodies with a surface of their own, and its surfels
  unsigned body_pairs = 0, obstacle_pairs = 0;         // pairs that may touch, filters applied
  unsigned rigid_bodies = 0, rigid_joints = 0;
  std::string rigid_hosts;                             // names
  bool gravity_keys = false, loads_vary = false, held_move = false, obstacles_move = false, unguarded = false;
  struct Provider { std::string effect, plugin; };
  std::vector<Provider> offered;                       // by models and laws that the scene uses, as their parameters stand
  std::vector<Provider> idle;                          // by models that the scene uses, if their parameters called for it
  std::vector<Provider> available;                     // by every loaded plugin
  bool effects_listed = false;
  bool sleep = false;                                  // islands at rest may sleep
  bool rollback = false;                               // contact.method
  bool self = false, self_auto = false;                // contact.self
  unsigned self_bodies = 0;                            // bodies that may touch themselves, filters applied
  std::vector<std::string> asked;                      // where listed
};

struct PlannedStage { StageId id; std::string why; };
struct AbsentStage { std::string name, why; };
struct PlannedEffect { std::string name, asked_by, provided_by; };

struct Plan {
  std::vector<PlannedStage> stages;                    // in the order of a sub-step
  std::vector<AbsentStage> absent;
  std::vector<PlannedEffect> effects;
  bool has(StageId id) const;
  bool touches() const;                                // has contact stages
  bool rolls_back() const;                             // and they are those of the roll-back
};

inline constexpr char kSelfContact[] = "self_contact";
// Who calls for self contact: "contact.self", "effects", the effect that needs it; "" where nobody does.
std::string self_asked_by(const SceneFacts &facts);

// Throws Error(DFM_E_ARG) where a listed effect is provided by nothing in the scene; names who could.
Plan make_plan(const SceneFacts &facts);

}  // namespace dfm
