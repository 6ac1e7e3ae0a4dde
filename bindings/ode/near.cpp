#include "near.h"

#include <algorithm>

namespace dfm_ode_detail {

void near_callback(void *data, dGeomID a, dGeomID b) {
  const NearCallback &n = *static_cast<const NearCallback *>(data);
  if (dGeomIsSpace(a) || dGeomIsSpace(b)) {
    dSpaceCollide2(a, b, data, near_callback);   // what lies inside one space is collided once, by the engine
    return;
  }
  const dBodyID body_a = dGeomGetBody(a), body_b = dGeomGetBody(b);
  if (body_a == body_b) return;            // two geoms of one body, or two that never move
  if (body_a && body_b && dAreConnectedExcluding(body_a, body_b, dJointTypeContact)) return;
  constexpr uint32_t kMost = 64;
  dContact contacts[kMost];
  const int found = dCollide(a, b, static_cast<int>(std::min(n.most, kMost)), &contacts[0].geom, sizeof(dContact));
  for (int i = 0; i < found; ++i) {
    dContact &c = contacts[i];
    c.surface = {};
    c.surface.mode = dContactApprox1;      // a pyramid on the normal force, not a box of fixed size
    c.surface.mu = n.friction;
    dJointAttach(dJointCreateContact(n.world, n.group, &c), body_a, body_b);
  }
}

}  // namespace dfm_ode_detail
