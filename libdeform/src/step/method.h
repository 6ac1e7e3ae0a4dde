// A contact method: the table of stages of a sub-step, what the method keeps of bodies, and what it cannot
// do. The method in use (contacts by velocities) has its table in step/step.cpp; libdeform/src/rollback/ has
// another one. Other rooms ask the plan for roles of stages (plan/plan.h), never which method a world has.
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
  // False: the sub-step cannot be taken, and nothing of it has been committed.
  // Null: the method has no such stage.
  bool (*run)(World &w, StepContext &step, uint32_t *trouble);
  std::string (*cost)(const World &w);           // what its cost grows with; null where run is
  StageChoice (*when)(const SceneFacts &facts);  // does it run, and why
  StageRole role = StageRole::none;
};

// What a method may be unable to do.
enum class Ability {
  self_stepping,  // models that step themselves
  own_surface,    // surfaces that hang on points of a body
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

// Buffers of a step that are for the stages of one method.
struct MethodBuffers { virtual ~MethodBuffers() = default; };

struct ContactMethod {
  const char *name;  // as a scene has it
  std::span<const Stage> table;
  const char *point_values = nullptr;  // what Body::method_values are; null: nothing is kept
  std::span<const Inability> unable = {};
  const char *remark = "";  // for the sentence that refuses what it cannot do
  std::unique_ptr<MethodBuffers> (*buffers)(const Memory &memory) = nullptr;
};

const ContactMethod &velocity_method();  // step.cpp
// For a world without bodies.
void use_method(World &w, const ContactMethod &method);
bool guards(const ContactMethod &method);  // has it a guard?
bool lacks(const ContactMethod &method, Ability what);
// Throws Error(DFM_E_UNSUPPORTED) where the world's method lacks it. kind and name: whose; empty where it is
// nobody's.
void need_ability(const World &w, Ability what, const char *kind = "", const std::string &name = {});

// Throws Error where an effect that is asked for is nowhere provided.
Plan make_plan(std::span<const Stage> table, const SceneFacts &facts);

}  // namespace dfm
