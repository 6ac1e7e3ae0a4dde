#include "seated.h"

#include <algorithm>

namespace dfm_rigid_detail {

dfm_pose to_pose(const Pose &p) {
  const Quat q = p.rotation;
  return {{p.position.x, p.position.y, p.position.z}, {q.x, q.y, q.z, q.w}};
}

dfm_status Seated::create(dfm_world in, const char *host, Member &m) {
  seat.member = &m;
  dfm_rigid_def def = dfm_rigid_def_default();
  const dfm_rigid_state engine = m.state();
  m.mark();
  def.shape = DFM_SHAPE_NONE;
  def.mass = m.inertia.mass;
  store(def.inertia, m.inertia.moments);
  std::copy(engine.position, engine.position + 3, def.pose.position);
  std::copy(engine.rotation, engine.rotation + 4, def.pose.rotation);
  std::copy(engine.velocity, engine.velocity + 3, def.velocity);
  std::copy(engine.spin, engine.spin + 3, def.spin);
  dfm_rigid_set_def set{};
  set.size = sizeof set;
  set.nbody = 1;
  set.bodies = &def;
  set.data = &seat;
  TRY(dfm_rigid_create(in, host, &set, &rigid));
  return dfm_rigid_get_state(rigid, &world);
}

dfm_status Seated::agree(bool restored) {
  Member &m = *seat.member;
  dfm_rigid_state now_world;
  TRY(dfm_rigid_get_state(rigid, &now_world));
  restored &= !fresh;
  fresh = false;
  m.restored |= restored;
  const bool stays = m.stays();
  if (stays && same(now_world, world)) return DFM_OK;
  if (restored || stays) {
    m.put(now_world);
  } else {
    const dfm_rigid_state now_engine = m.state();
    TRY(dfm_rigid_set_state(rigid, &now_engine));
  }
  m.mark();
  return dfm_rigid_get_state(rigid, &world);
}

dfm_status Seated::release() {
  seat.leaves = true;
  return dfm_rigid_destroy(rigid);
}

dfm_status Seated::after(dfm_status of_step) {
  Member &m = *seat.member;
  const dfm_status told = dfm_rigid_get_state(rigid, &world);
  if (of_step != DFM_OK && told == DFM_OK && !same(world, m.state())) m.put(world);
  m.mark();
  return told;
}

dfm_status Clock::ask(dfm_world world, bool &restored) {
  dfm_world_stats now{};
  now.size = sizeof now;
  TRY(dfm_world_get_stats(world, &now));
  restored = now.time != time || now.steps != steps;
  time = now.time;
  steps = now.steps;
  return DFM_OK;
}

dfm_status unbind(dfm_obstacle &obstacle) {
  const dfm_status status = obstacle ? dfm_obstacle_destroy(obstacle) : dfm_status{DFM_OK};
  if (status != DFM_OK && status != DFM_E_HANDLE) return status;
  obstacle = 0;
  return DFM_OK;
}

dfm_status follow(dfm_obstacle &obstacle, Pose &known, const Pose &now) {
  const Vec p = now.position - known.position;
  const Quat q = now.rotation, r = known.rotation;
  if (dot(p, p) == 0 && q.x == r.x && q.y == r.y && q.z == r.z && q.w == r.w) return DFM_OK;
  known = now;
  const dfm_pose pose = to_pose(now);
  const dfm_status status = dfm_obstacle_move_to(obstacle, &pose);
  if (status != DFM_E_HANDLE) return status;
  obstacle = 0;  // as in unbind
  return DFM_OK;
}

}  // namespace dfm_rigid_detail
