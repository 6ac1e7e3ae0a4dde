// Attachments in a step: bonds of the contact solve before it, impulses and releases after it.
#pragma once
#include <cstdint>

#include "math/vec3.h"
#include "state/motion.h"

namespace dfm {

struct Attachment;
struct Obstacle;
struct StepContext;
struct World;

// The bonds of this sub-step, and the impulses that they start from: those of the last sub-step, or where the
// same sub-step is solved again (`again`), those of its last solve.
void make_bonds(World &w, StepContext &step, bool again);
// Of the sub-step that has been taken. Those whose force is above what releases them hold no more.
void keep_bonds(World &w, StepContext &step);
// Released ones go, between two steps.
void drop_released(World &w);
// All of a body or an obstacle that goes, with an event each.
void drop_attachments(World &w, uint64_t id);

// Bodies that sleep while what they are attached to moves.
void wake_attached(World &w, StepContext &step);
// What places on it are told in: a rigid body's center of mass and axes; else the obstacle's own frame.
Pose attached_frame(const Obstacle &o);
// Where point i is held now, m.
Vec3 attached_place(const World &w, const Attachment &a, size_t i);

}  // namespace dfm
