// deform/obstacles.hpp -- part of deform.hpp: what changes of an obstacle while the world runs. Comments of
// deform/obstacle.h hold.
#ifndef DEFORM_OBSTACLES_HPP
#define DEFORM_OBSTACLES_HPP
#include <cstdint>

#include "deform/obstacle.h"

namespace deform::basic {

template <class E, class Self>
class ObstacleChanges {
 public:
  auto set_velocity_surface(const double (&velocity)[3]) const {
    return E::done(dfm_obstacle_set_velocity_surface(obstacle(), velocity));
  }
  auto set_filter(uint32_t category, uint32_t collides_with) const {
    return E::done(dfm_obstacle_set_filter(obstacle(), category, collides_with));
  }
  auto set_material(dfm_material material) const {
    return E::done(dfm_obstacle_set_material(obstacle(), material));
  }

 private:
  dfm_obstacle obstacle() const { return static_cast<const Self &>(*this).get(); }
};

}  // namespace deform::basic
#endif
