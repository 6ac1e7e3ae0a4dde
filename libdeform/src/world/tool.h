// Creates, removes and moves tools. All functions throw Error; then the world is unchanged.
#pragma once
#include <cstdint>
#include <vector>

#include "deform/tool.h"

namespace dfm {

struct Body;
struct Tool;
struct World;

Tool &create_tool(World &w, const dfm_tool_def &def);
void destroy_tool(Tool &tool);
// velocity: [6] or NULL; set_tool_pose() checks them
void check_target(Tool &tool, const dfm_pose &pose, const double *velocity);
void set_tool_pose(Tool &tool, const dfm_pose &pose, const double *velocity);
void set_tool_opening(Tool &tool, double angle);
void follow_keys(Tool &tool);
void keys_at(const Tool &tool, double t, dfm_pose &pose, double &opening);
void teleport_tool(Tool &tool, const dfm_pose &pose);
dfm_tool_state tool_state(const Tool &tool);
// Force and torque over the last step: of contact on the tool in its frame, or of the coupling on the device
// in the device's frame.
void tool_force(const Tool &tool, double force[3], double torque[3]);
void tool_feedback(const Tool &tool, double force[3], double torque[3]);

// Numbers of the attachments, one for each part that holds surfels.
std::vector<uint32_t> grab(Tool &tool, Body &b, double reach, double release, uint32_t capacity);
void set_device(Tool &tool, const dfm_device *device);
// Called before and after a step. read_devices() throws Error if a device fails; then nothing has moved.
void read_devices(World &w, double end);
void write_devices(World &w);

}  // namespace dfm
