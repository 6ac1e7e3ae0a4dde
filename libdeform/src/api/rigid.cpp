#include "deform/rigid.h"

#include <algorithm>

#include "api/objects.h"
#include "state/obstacle.h"
#include "step/rigid/rigid.h"
#include "step/stages.h"

using namespace dfm;

namespace {

Obstacle &rigid_of(dfm_rigid h) {
  Obstacle &o = obstacle_of(h);
  if (!o.rigid)
    fail(DFM_E_HANDLE,
         "handle 0x%llx belongs to obstacle '%s', which is not a rigid body; pass the handle of a rigid body",
         static_cast<unsigned long long>(h), o.name.c_str());
  return o;
}

// A rigid body that is not part of a tool.
Obstacle &free_rigid_of(dfm_rigid h, const char *instead) {
  Obstacle &o = rigid_of(h);
  if (o.rigid->of_tool) fail(DFM_E_STATE, "'%s' is part of a tool; %s", o.name.c_str(), instead);
  return o;
}

bool is_listed(const Obstacle &o) { return o.rigid && !o.added && !o.rigid->of_tool; }
uint32_t listed_rigids(const World &w) {
  uint32_t count = 0;
  for (auto &o : w.obstacles) count += is_listed(*o);
  return count;
}

}  // namespace

dfm_status dfm_rigid_host_register(const char *name, const dfm_rigid_host *table) {
  return as_status([&] {
    need(name, "name");
    need(table, "table");
    register_host(name, take_known(table, dfm_rigid_host{}));
  });
}

dfm_status dfm_rigid_create(dfm_world world, const char *host, const dfm_rigid_set_def *set, dfm_rigid *out) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    need(set, "set");
    need(out, "out");
    dfm_rigid_set_def def = take_def(set, dfm_rigid_set_def{});
    const auto bodies = take_defs(def.bodies, def.nbody, dfm_rigid_def_default(), "rigid body",
                                  "start from dfm_rigid_def_default()");
    const auto joints = take_defs(def.joints, def.njoint, dfm_joint_def{}, "joint", "set it to sizeof");
    if (def.bodies) def.bodies = bodies.data();
    if (def.joints) def.joints = joints.data();
    create_rigids(w, host, def, out);
  });
}

dfm_status dfm_rigid_destroy(dfm_rigid rigid) {
  return as_status([&] {
    Obstacle &o = exclusive(free_rigid_of(rigid, "dfm_tool_destroy removes it"));
    destroy_rigids(*o.rigid);
  });
}

dfm_status dfm_rigid_add_shape(dfm_rigid rigid, const dfm_obstacle_def *def, dfm_obstacle *out) {
  return as_status(to_change<rigid_of>, rigid, [&](Obstacle &o) {
    need(def, "def");
    need(out, "out");
    *out = add_rigid_shape(o, take_def(def, dfm_obstacle_def_default())).handle;
  });
}

dfm_status dfm_world_rigids(dfm_world world, uint32_t capacity, dfm_rigid *out, uint32_t *n) {
  return as_status(world_of, world, [&](const World &w) {
    if (!room(listed_rigids(w), capacity, out, n)) return;
    for (auto &o : w.obstacles)
      if (is_listed(*o)) *out++ = o->handle;
  });
}

dfm_status dfm_world_rigid_states(dfm_world world, uint32_t capacity, dfm_rigid *rigids,
                                  dfm_rigid_state *states, uint32_t *n) {
  return as_status(world_of, world, [&](const World &w) {
    if (!states && rigids) need(states, "states");
    if (!room(listed_rigids(w), capacity, states, n)) return;
    for (auto &o : w.obstacles) {
      if (!is_listed(*o)) continue;
      if (rigids) *rigids++ = o->handle;
      *states++ = o->rigid->state[o->rigid_body];
    }
  });
}

dfm_status dfm_world_find_rigid(dfm_world world, const char *name, dfm_rigid *out) {
  return as_status([&] {
    find_named(world_of(world).obstacles, "rigid body", name, out,
               [](const Obstacle &o) { return o.rigid && !o.added; });
  });
}

dfm_status dfm_rigid_get_def(dfm_rigid rigid, dfm_rigid_def *out) {
  return as_status(rigid_of, rigid, [&](const Obstacle &o) { copy_out(out, o.rigid->defs[o.rigid_body]); });
}

dfm_status dfm_rigid_get_state(dfm_rigid rigid, dfm_rigid_state *out) {
  return as_status(rigid_of, rigid, [&](const Obstacle &o) {
    need(out, "out");
    *out = o.rigid->state[o.rigid_body];
  });
}

dfm_status dfm_rigid_set_state(dfm_rigid rigid, const dfm_rigid_state *state) {
  return as_status([&] {
    Obstacle &o = free_rigid_of(rigid, "move it with dfm_tool_teleport");
    World &w = exclusive(*o.world);
    need(state, "state");
    set_rigid_state(o, *state);
    for (auto &shape : w.obstacles)
      if (shape->rigid == o.rigid && shape->rigid_body == o.rigid_body) w.overlaps.place(shape->id);
    wake_all(w);  // it may have been placed where a body sleeps
  });
}

dfm_status dfm_rigid_get_measure(dfm_rigid rigid, dfm_body_measure *out) {
  return as_status(rigid_of, rigid,
                   [&](const Obstacle &o) { copy_out(out, measure_rigid(*o.rigid, o.rigid_body)); });
}

dfm_status dfm_rigid_contact_wrench(dfm_rigid rigid, double force[3], double moment[3]) {
  return as_status(rigid_of, rigid, [&](const Obstacle &o) {
    need(force, "force");
    need(moment, "moment");
    const double *const wrench = &o.rigid->wrench[6 * size_t{o.rigid_body}];
    std::copy_n(wrench, 3, force);
    std::copy_n(wrench + 3, 3, moment);
  });
}

dfm_status dfm_rigid_set_motor(dfm_rigid rigid, uint32_t joint, double velocity, double max) {
  return as_status(to_change<rigid_of>, rigid,
                   [&](Obstacle &o) { set_rigid_motor(*o.rigid, joint, velocity, max); });
}

dfm_status dfm_rigid_joint(dfm_rigid rigid, uint32_t joint, double *position, double *rate, double *effort) {
  return as_status([&] { rigid_joint(*rigid_of(rigid).rigid, joint, position, rate, effort); });
}
