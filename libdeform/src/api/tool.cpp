#include "deform/tool.h"

#include <algorithm>

#include "api/objects.h"
#include "cut/tool_cut.h"
#include "state/tool.h"
#include "world/tool.h"

using namespace dfm;

namespace {

Tool &tool_of(dfm_tool h) { return part_of<Tool>(Kind::tool, h); }

}  // namespace

dfm_status dfm_tool_create(dfm_world world, const dfm_tool_def *def, dfm_tool *out) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    need(def, "def");
    need(out, "out");
    const dfm_tool_def own = take_def(def, dfm_tool_def_default());
    check_flags(own, DFM_TOOL_PASSIVE, "dfm_tool_def");
    *out = create_tool(w, own).handle;
  });
}

dfm_status dfm_tool_destroy(dfm_tool tool) {
  return as_status([&] { destroy_tool(exclusive(tool_of(tool))); });
}

dfm_status dfm_world_tools(dfm_world world, uint32_t capacity, dfm_tool *out, uint32_t *n) {
  return as_status(world_of, world, [&](const World &w) { copy_list(w.tools, capacity, out, n, kHandle); });
}

dfm_status dfm_world_find_tool(dfm_world world, const char *name, dfm_tool *out) {
  return as_status([&] { find_named(world_of(world).tools, "tool", name, out); });
}

dfm_status dfm_tool_get_def(dfm_tool tool, dfm_tool_def *out) {
  return as_status([&] { copy_out(out, tool_of(tool).def); });
}

dfm_status dfm_tool_parts(dfm_tool tool, uint32_t capacity, dfm_rigid *out, uint32_t *n) {
  return as_status(tool_of, tool, [&](const Tool &t) { copy_list(t.parts, capacity, out, n); });
}

dfm_status dfm_tool_set_pose(dfm_tool tool, const dfm_pose *pose, const double velocity[6]) {
  return as_status(to_change<tool_of>, tool, [&](Tool &t) {
    need(pose, "pose");
    if (t.device.read) check_target(t, *pose, velocity);
    else set_tool_pose(t, *pose, velocity);
  });
}

dfm_status dfm_tool_set_opening(dfm_tool tool, double angle) {
  return as_status([&] { set_tool_opening(exclusive(tool_of(tool)), angle); });
}

dfm_status dfm_tool_follow_keys(dfm_tool tool) {
  return as_status([&] { follow_keys(exclusive(tool_of(tool))); });
}

dfm_status dfm_tool_keys_at(dfm_tool tool, double t, dfm_pose *pose, double *opening) {
  return as_status(to_read<tool_of>, tool, [&](const Tool &own) {
    dfm_pose at{};
    double angle = 0;
    keys_at(own, t, at, angle);
    if (pose) *pose = at;
    if (opening) *opening = angle;
  });
}

dfm_status dfm_tool_teleport(dfm_tool tool, const dfm_pose *pose) {
  return as_status(to_change<tool_of>, tool, [&](Tool &t) {
    need(pose, "pose");
    teleport_tool(t, *pose);
  });
}

dfm_status dfm_tool_force(dfm_tool tool, double force[3], double torque[3]) {
  return as_status(to_read<tool_of>, tool, [&](const Tool &t) {
    need(force, "force");
    need(torque, "torque");
    tool_force(t, force, torque);
  });
}

dfm_status dfm_tool_feedback(dfm_tool tool, double force[3], double torque[3]) {
  return as_status(to_read<tool_of>, tool, [&](const Tool &t) {
    need(force, "force");
    need(torque, "torque");
    tool_feedback(t, force, torque);
  });
}

dfm_status dfm_tool_get_state(dfm_tool tool, dfm_tool_state *out) {
  return as_status([&] { copy_out(out, tool_state(not_in_step(tool_of(tool)))); });
}

dfm_status dfm_tool_grab(dfm_tool tool, dfm_body body, double reach, double release, uint32_t capacity,
                         uint32_t *attachment, uint32_t *n) {
  return as_status(to_change<tool_of>, tool, [&](Tool &t) {
    need(attachment, "attachment");
    need(n, "n");
    const std::vector<uint32_t> made = grab(t, body_of(body), reach, release, capacity);
    std::copy(made.begin(), made.end(), attachment);
    *n = static_cast<uint32_t>(made.size());
  });
}

dfm_status dfm_tool_set_cuts(dfm_tool tool, uint32_t how, uint32_t most, uint32_t n, const dfm_body *bodies) {
  return as_status(to_change<tool_of>, tool, [&](Tool &t) {
    if (n) need(bodies, "bodies");
    std::vector<Body *> list;
    for (uint32_t i = 0; i < n; ++i) list.push_back(&body_of(bodies[i]));
    set_cuts(t, how, most, list);
  });
}

dfm_status dfm_tool_cuts(dfm_tool tool, uint32_t *how, uint32_t *most, uint32_t capacity, dfm_body *bodies,
                         uint32_t *n) {
  return as_status(tool_of, tool, [&](const Tool &t) {
    std::vector<dfm_body> list;
    for (const uint64_t id : t.cuts.bodies)
      if (const uint64_t handle = t.world->handle_of(id)) list.push_back(handle);
    if (how) *how = t.cuts.how;
    if (most) *most = t.cuts.most;
    copy_list(list, capacity, bodies, n);
  });
}

dfm_status dfm_tool_set_device(dfm_tool tool, const dfm_device *device) {
  return as_status(to_change<tool_of>, tool, [&](Tool &t) {
    if (!device) return set_device(t, nullptr);
    const dfm_device own = take_known(device, dfm_device{});
    refuse_unknown(device);
    check_flags(own, 0, "dfm_device");
    set_device(t, &own);
  });
}
