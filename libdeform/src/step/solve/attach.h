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

// Makes the bonds of this sub-step, with their initial impulses: those of the last sub-step, or of the last
// solve if the same sub-step is solved again (`again`).
void make_bonds(World &w, StepContext &step, bool again);
// Keeps the impulses of the completed sub-step. Releases attachments whose force is above their limit.
void keep_bonds(World &w, StepContext &step);
// Lets what released attachments held touch, once. False: there are no new ones.
bool part_released(World &w);
// Removes released attachments, between two steps.
void drop_released(World &w);
// Removes all attachments of a removed body or obstacle, with an event each.
void drop_attachments(World &w, uint64_t id);

// Wakes bodies that sleep while the thing to which they are attached moves.
void wake_attached(World &w, StepContext &step);
// Mean velocity in this sub-step, without contact, of the place x of a rigid body.
Vec3 place_velocity(const Obstacle &o, Vec3 x, const StepContext &step);
// The frame of places on it: center of mass and axes of a rigid body; else the frame of the obstacle.
Pose attached_frame(const Obstacle &o);
// The present target of point i, m.
Vec3 attached_place(const World &w, const Attachment &a, size_t i);

}  // namespace dfm
