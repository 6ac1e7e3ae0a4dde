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

dfm_status States::poll(dfm_world world) {
  next_ = count_ = 0;
  uint32_t n = 0;
  const auto room = [&] { return static_cast<uint32_t>(rigids_.size()); };
  // There is room for those of the last time, which mostly are those of now.
  if (dfm_world_rigid_states(world, room(), rigids_.data(), states_.data(), &n) != DFM_OK || n > room()) {
    TRY(dfm_world_rigid_states(world, 0, nullptr, nullptr, &n));
    rigids_.resize(n);
    states_.resize(n);
    if (n > 0) TRY(dfm_world_rigid_states(world, n, rigids_.data(), states_.data(), &n));
  }
  count_ = n;
  return DFM_OK;
}

const dfm_rigid_state *States::of(dfm_rigid rigid) {
  if (next_ == count_ || rigids_[next_] != rigid)
    next_ = static_cast<size_t>(std::find(rigids_.data(), rigids_.data() + count_, rigid) - rigids_.data());
  return next_ < count_ ? &states_[next_++] : nullptr;
}

dfm_status Seated::agree(bool restored, States &now) {
  Member &m = *seat.member;
  const dfm_rigid_state *const now_world = now.of(rigid);
  if (!now_world) return dfm_rigid_get_state(rigid, &world);  // its sentence
  restored &= !fresh;
  fresh = false;
  m.restored |= restored;
  const bool stays = m.stays();
  if (stays && same(*now_world, world)) return DFM_OK;
  if (restored || stays) {
    m.put(*now_world);
  } else {
    const dfm_rigid_state now_engine = m.state();
    TRY(dfm_rigid_set_state(rigid, &now_engine));
  }
  m.mark();
  return dfm_rigid_get_state(rigid, &world);
}

dfm_status Seated::release() {
  seat.removable = true;
  return dfm_rigid_destroy(rigid);
}

dfm_status Seated::after(dfm_status of_step, States &now) {
  Member &m = *seat.member;
  const dfm_rigid_state *const known = now.of(rigid);
  if (known) world = *known;
  const dfm_status get_status = known ? dfm_status{DFM_OK} : dfm_rigid_get_state(rigid, &world);
  if (of_step != DFM_OK && get_status == DFM_OK && !same(world, m.state())) m.put(world);
  m.mark();
  return get_status;
}

dfm_status Clock::poll(dfm_world world) {
  dfm_world_stats now{};
  now.size = sizeof now;
  TRY(dfm_world_get_stats(world, &now));
  restored |= now.time != time || now.steps != steps;
  time = now.time;
  steps = now.steps;
  return DFM_OK;
}

namespace {

dfm_status unless_gone(dfm_obstacle &obstacle, dfm_status status) {
  if (status != DFM_E_HANDLE) return status;
  obstacle = 0;
  return DFM_OK;
}

bool is_at(const Pose &known, const Pose &now) {
  const Vec p = now.position - known.position;
  const Quat q = now.rotation, r = known.rotation;
  const Vec turn{q.x - r.x, q.y - r.y, q.z - r.z};
  constexpr double kRounding = 1e-14;  // the dfm_world normalizes rotations
  return dot(p, p) == 0 && dot(turn, turn) + (q.w - r.w) * (q.w - r.w) < kRounding * kRounding;
}

}  // namespace

dfm_status unbind(dfm_obstacle &obstacle) {
  if (obstacle) TRY(unless_gone(obstacle, dfm_obstacle_destroy(obstacle)));
  obstacle = 0;
  return DFM_OK;
}

dfm_status set_filter(dfm_obstacle &obstacle, uint32_t category, uint32_t collides_with, Pose *known,
                      const Pose &now) {
  if (!obstacle) return DFM_OK;
  if (known && !is_at(*known, now)) {
    *known = now;
    const dfm_pose pose = to_pose(now);
    TRY(unless_gone(obstacle, dfm_obstacle_teleport(obstacle, &pose)));
  }
  return unless_gone(obstacle, dfm_obstacle_set_filter(obstacle, category, collides_with));
}

dfm_status find_again(dfm_obstacle &obstacle, Pose &known) {
  dfm_pose there;
  const dfm_status status = dfm_obstacle_get_pose(obstacle, &there);
  if (status == DFM_OK) known = {load(there.position), load_quat(there.rotation)};
  return unless_gone(obstacle, status);
}

dfm_status follow(dfm_obstacle &obstacle, Pose &known, const Pose &now) {
  if (is_at(known, now)) return DFM_OK;
  known = now;
  const dfm_pose pose = to_pose(now);
  return unless_gone(obstacle, dfm_obstacle_move_to(obstacle, &pose));
}

}  // namespace dfm_rigid_detail
