// The default near callback: contact joints with Coulomb friction between geoms of different bodies that no joint ties together.
#pragma once
#include <ode/ode.h>

#include <cstdint>

namespace dfm_ode_detail {

struct NearCallback {
  dWorldID world = nullptr;
  dJointGroupID group = nullptr;
  double friction = 0.5;
  uint32_t most = 8;
};
void near_callback(void *data, dGeomID a, dGeomID b);   // dNearCallback; data: a NearCallback

}  // namespace dfm_ode_detail
