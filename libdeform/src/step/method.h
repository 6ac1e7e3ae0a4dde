// A contact method: the table of stages of a sub-step, its data per body, and its limits. The usual method
// (contacts by velocities) has its table in step/step.cpp; libdeform/src/rollback/ has another one. Other
// rooms use the roles of stages in the plan (plan/plan.h) and do not depend on the method.
#pragma once
#include <memory>
#include <span>
#include <string>

#include "core/memory.h"
#include "plan/plan.h"

namespace dfm {

struct StepContext;
struct World;

// A row of a table of stages. A table is in the order of a sub-step.
struct Stage {
  const char *name;
  // Returns false if the sub-step failed; nothing of it has been committed. Null: the method has no such
  // stage.
  bool (*run)(World &w, StepContext &step, uint32_t *trouble);
  std::string (*cost)(const World &w);           // what its cost grows with; null if run is null
  StageChoice (*when)(const SceneFacts &facts);  // whether it runs, and why
  StageRole role = StageRole::none;
};

// Features that a method may lack.
enum class Ability {
  self_stepping,  // models that step themselves
  own_surface,    // surfaces coupled to points of a body
  held_motion,
  voxels,
  obstacle_motion,
  law_memory,  // friction laws that have a state per contact
  rigid_bodies,
  sleep,
  self_contact,
  attachments,
};

struct Inability {
  Ability what;
  const char *why;  // subject of the sentence "... cannot be in a world whose contact method is"
};

// Buffers of a step for the stages of one method.
struct MethodBuffers { virtual ~MethodBuffers() = default; };

struct ContactMethod {
  const char *name;  // as in scenes
  std::span<const Stage> table;
  const char *point_values = nullptr;  // meaning of Body::method_values; null: none
  std::span<const Inability> unable = {};
  const char *remark = "";  // for the message about a missing feature
  std::unique_ptr<MethodBuffers> (*buffers)(const Memory &memory) = nullptr;
};

const ContactMethod &velocity_method();  // step.cpp
// For a world without bodies.
void use_method(World &w, const ContactMethod &method);
bool guards(const ContactMethod &method);  // whether it has a guard
bool lacks(const ContactMethod &method, Ability what);
// Throws Error(DFM_E_UNSUPPORTED) if the world's method lacks it. kind and name: of the object that needs it;
// empty: none.
void need_ability(const World &w, Ability what, const char *kind = "", const std::string &name = {});

// Throws Error if nothing provides a requested effect.
Plan make_plan(std::span<const Stage> table, const SceneFacts &facts);

}  // namespace dfm
