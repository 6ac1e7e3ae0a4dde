// The table of stages of the method `rollback`, and its limits.
#include "rollback/rollback.h"

#include "rollback/stages.h"
#include "step/stage_costs.h"
#include "step/stages.h"

namespace dfm::rollback {
namespace {

constexpr char kWhyNot[] = "contact.method is rollback";

bool touches(const SceneFacts &f) { return when::solve(f).runs; }
StageChoice with_contact(const SceneFacts &f, const char *why) {
  return touches(f) ? StageChoice{true, why} : StageChoice{};
}

StageChoice when_lagged(const SceneFacts &f) {
  return with_contact(f, "friction that the last sub-step found");
}
StageChoice when_rollback(const SceneFacts &f) {
  return with_contact(
      f,
      "contact.method rollback: vertices that collide go back to their time of impact; only for comparison");
}
StageChoice replaced(const SceneFacts &f) {
  return touches(f) ? StageChoice{false, kWhyNot} : when::solve(f);
}
StageChoice unguarded(const SceneFacts &) { return {false, kWhyNot}; }
StageChoice no_self(const SceneFacts &f) { return touches(f) ? StageChoice{} : when::self(f); }

std::string candidates_again(const World &) { return "candidate pairs, again while any is tied"; }

bool lagged_friction(World &w, StepContext &step, uint32_t *) {
  stage_lagged(w, step);
  return true;
}

// Rows without a function give the reason why a stage of the method velocity is missing.
constexpr Stage kTable[] = {
    {"motion", row::motion, cost::prescribed, when::motion},
    {"model", row::model, cost::cells, when::model},
    {"predict", row::predict, cost::points, when::predict},
    {"rigid predict", nullptr, nullptr, when::rigid_predict},
    {"gather", nullptr, nullptr, when::gather},
    {"lagged friction", lagged_friction, cost::points, when_lagged},
    {"broad", row::broad, cost::surfels_and_triangles, when::broad, StageRole::lists_pairs},
    {"rollback", stage_rollback, candidates_again, when_rollback, StageRole::solves},
    {"narrow", nullptr, nullptr, replaced},
    {"self contact", nullptr, nullptr, no_self},
    {"contact+friction", nullptr, nullptr, replaced},
    {"distribute", nullptr, nullptr, replaced},
    {"guard", nullptr, nullptr, unguarded},
    {"commit", stage_commit, cost::points, when::commit},
    {"sleep", nullptr, nullptr, when::sleep},
};

constexpr Inability kUnable[] = {
    {Ability::self_stepping, "a model that steps itself, whose vertices this method cannot move,"},
    {Ability::own_surface, "a surface of its own, for which Zerbato (2010) moves no points of the body,"},
    {Ability::held_motion, "a motion of held points, which cannot go back,"},
    {Ability::voxels, "voxels, against which no time of impact is known,"},
    {Ability::obstacle_motion, "a motion of its own, which cannot go back,"},
    {Ability::law_memory, "a memory, which would see no slip of what is frozen,"},
    {Ability::rigid_bodies, "rigid bodies, which a host moves,"},
    {Ability::sleep, "sleep (contact.sleep)"},
    {Ability::self_contact, "self contact"},
    {Ability::attachments, "an attachment, which is a part of the contact solve,"},
};

constexpr ContactMethod kMethod{.name = "rollback",
                                .table = kTable,
                                .point_values = "lagged friction",
                                .unable = kUnable,
                                .remark = " (it exists only for comparison: doc/concepts/rollback.md)",
                                .buffers = make_buffers};

}  // namespace

const ContactMethod &method() { return kMethod; }

}  // namespace dfm::rollback
