// deform/obstacles.hpp -- part of deform.hpp: obstacles and rigid bodies. Comments of deform/obstacle.h and
// deform/rigid.h hold.
#ifndef DEFORM_OBSTACLES_HPP
#define DEFORM_OBSTACLES_HPP
#include <cstdint>

#include "deform/defs.hpp"
#include "deform/obstacle.h"
#include "deform/queries.hpp"
#include "deform/result.hpp"
#include "deform/rigid.h"

namespace deform::basic {

template <class E>
class Obstacle : public Handle<dfm_obstacle, struct ObstacleKind>, public ObstacleQueries<E, Obstacle<E>> {
 public:
  using Handle::Handle;
  static void end(dfm_obstacle obstacle) noexcept { dfm_obstacle_destroy(obstacle); }
  auto destroy() const { return E::done(dfm_obstacle_destroy(raw_)); }
  auto pose() const {
    return produce<E, dfm_pose>([&](dfm_pose &p) { return dfm_obstacle_get_pose(raw_, &p); });
  }
  auto def() const {
    return produce<E, dfm_obstacle_def>([&](dfm_obstacle_def &d) {
      d.size = sizeof d;
      return dfm_obstacle_get_def(raw_, &d);
    });
  }
  auto move_to(const dfm_pose &pose) const { return E::done(dfm_obstacle_move_to(raw_, &pose)); }
  auto teleport(const dfm_pose &pose) const { return E::done(dfm_obstacle_teleport(raw_, &pose)); }
  auto set_velocity_surface(const Vec3 &velocity) const {
    return E::done(dfm_obstacle_set_velocity_surface(raw_, velocity.data()));
  }
  auto set_filter(uint32_t category, uint32_t collides_with) const {
    return E::done(dfm_obstacle_set_filter(raw_, category, collides_with));
  }
  auto set_material(dfm_material material) const {
    return E::done(dfm_obstacle_set_material(raw_, material));
  }
};

// Converts to Obstacle: poses, pair rules and reports take it.
template <class E>
class Rigid : public Handle<dfm_rigid, struct RigidKind>, public ObstacleQueries<E, Rigid<E>> {
 public:
  using Handle::Handle;
  // Ends the whole set that the body came with.
  static void end(dfm_rigid rigid) noexcept { dfm_rigid_destroy(rigid); }
  auto destroy() const { return E::done(dfm_rigid_destroy(raw_)); }
  static auto register_host(Text name, const dfm_rigid_host &table) {
    return E::done(dfm_rigid_host_register(name.c_str, &table));
  }
  operator Obstacle<E>() const noexcept { return Obstacle<E>(raw_); }
  auto def() const {
    return produce<E, dfm_rigid_def>([&](dfm_rigid_def &d) {
      d.size = sizeof d;
      return dfm_rigid_get_def(raw_, &d);
    });
  }
  auto state() const {
    return produce<E, dfm_rigid_state>([&](dfm_rigid_state &s) { return dfm_rigid_get_state(raw_, &s); });
  }
  auto set_state(const dfm_rigid_state &state) const { return E::done(dfm_rigid_set_state(raw_, &state)); }
  auto add_shape(const dfm_obstacle_def &def) const {
    return produce<E, Obstacle<E>>([&](Obstacle<E> &o) { return dfm_rigid_add_shape(raw_, &def, o.put()); });
  }
  auto measure() const {
    return produce<E, dfm_body_measure>([&](dfm_body_measure &m) {
      m.size = sizeof m;
      return dfm_rigid_get_measure(raw_, &m);
    });
  }
  auto contact_wrench() const {
    return produce<E, Wrench>(
        [&](Wrench &w) { return dfm_rigid_contact_wrench(raw_, w.force.data(), w.moment.data()); });
  }
  auto set_motor(uint32_t joint, double velocity, double max) const {
    return E::done(dfm_rigid_set_motor(raw_, joint, velocity, max));
  }
  auto joint(uint32_t joint) const {
    return produce<E, JointState>(
        [&](JointState &j) { return dfm_rigid_joint(raw_, joint, &j.position, &j.rate, &j.effort); });
  }
};

}  // namespace deform::basic
#endif
