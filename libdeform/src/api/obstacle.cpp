#include "deform/obstacle.h"

#include <cmath>

#include "api/objects.h"
#include "state/bounds.h"
#include "state/tool.h"
#include "step/stages.h"
#include "world/create.h"
#include "world/obstacle_change.h"

using namespace dfm;

dfm_status dfm_obstacle_create(dfm_world world, const dfm_obstacle_def *def, dfm_obstacle *out) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    need(out, "out");
    *out = create_obstacle(w, take_def(def, dfm_obstacle_def_default())).handle;
  });
}

dfm_status dfm_obstacle_destroy(dfm_obstacle obstacle) {
  return as_status(to_change<obstacle_of>, obstacle, [&](Obstacle &o) {
    if (o.rigid && !o.added)
      fail(DFM_E_STATE, "'%s' is a rigid body; remove it with dfm_rigid_destroy, which removes its whole set",
           o.name.c_str());
    for (const auto &t : o.world->tools)
      if (t->has_shape(o))
        fail(DFM_E_STATE, "'%s' is a part of tool '%s'; remove it with dfm_tool_destroy, which removes all",
             o.name.c_str(), t->name.c_str());
    destroy_obstacle(o);
  });
}

dfm_status dfm_obstacle_get_pose(dfm_obstacle obstacle, dfm_pose *out) {
  return as_status(obstacle_of, obstacle, [&](const Obstacle &o) {
    need(out, "out");
    store_pose(*out, o.pose);
  });
}

dfm_status dfm_obstacle_get_def(dfm_obstacle obstacle, dfm_obstacle_def *out) {
  return as_status([&] { copy_out(out, obstacle_of(obstacle).def); });
}

namespace {

// Checks the pose that a host gives to an obstacle.
Obstacle &movable(dfm_obstacle obstacle, const dfm_pose *pose) {
  Obstacle &o = exclusive(obstacle_of(obstacle));
  need(pose, "pose");
  if (o.rigid) fail(DFM_E_STATE, "'%s' is a rigid body; move it with dfm_rigid_set_state", o.name.c_str());
  for (int i = 0; i < 4; ++i)
    if (!std::isfinite(pose->rotation[i]) || (i < 3 && !std::isfinite(pose->position[i])))
      refuse(o, ": the target pose is not finite");
  check_place(*o.world, o, largest_coordinate(pose->position, 1, 3));
  return o;
}

}  // namespace

dfm_status dfm_obstacle_move_to(dfm_obstacle obstacle, const dfm_pose *pose) {
  return as_status([&] {
    Obstacle &o = movable(obstacle, pose);
    o.keys.clear();
    o.def.sine = {};
    o.target = to_pose(*pose);
    o.has_target = true;
  });
}

dfm_status dfm_obstacle_teleport(dfm_obstacle obstacle, const dfm_pose *pose) {
  return as_status([&] {
    Obstacle &o = movable(obstacle, pose);
    World &w = *o.world;
    w.overlaps.place(o.id);
    wake_all(w);  // it may have been placed where a body sleeps, or removed from under one
    o.keys.clear();
    o.def.sine = {};
    o.pose = to_pose(*pose);
    o.has_target = false;
    ++w.placements;
  });
}

dfm_status dfm_obstacle_set_velocity_surface(dfm_obstacle obstacle, const double velocity[3]) {
  return as_status(to_change<obstacle_of>, obstacle, [&](Obstacle &o) {
    need(velocity, "velocity");
    set_belt(o, load3(velocity));
  });
}

dfm_status dfm_obstacle_set_filter(dfm_obstacle obstacle, uint32_t category, uint32_t collides_with) {
  return as_status([&] { set_filter(exclusive(obstacle_of(obstacle)), category, collides_with); });
}

dfm_status dfm_obstacle_set_material(dfm_obstacle obstacle, dfm_material material) {
  return as_status(to_change<obstacle_of>, obstacle,
                   [&](Obstacle &o) { set_material(o, material ? &material_of(material) : nullptr); });
}

dfm_status dfm_world_find_obstacle(dfm_world world, const char *name, dfm_obstacle *out) {
  return as_status([&] { find_named(world_of(world).obstacles, "obstacle", name, out); });
}
