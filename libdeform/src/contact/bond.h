// A surfel of body a held at a place of something else: three rows of the contact solve, in world axes.
//
//     u + rate + soft l = 0      u: mean velocity of the surfel against the place; l: impulse on it, N s
//
// Rigid: rate = gap / h and soft = 0, so the surfel ends where it is held. With a stiffness k and a damping c
// the force is -k (gap + h u) - c u, that of a spring and a damper at the end of the sub-step, which no
// stiffness makes unstable: with s = h^2 k + h c, rate = h k gap / s and soft = 1 / s.
//
// The place gets -l: the surfels of a body by the weights with which their velocity is read, a rigid body at
// the point of the surfel. So both momenta are conserved whatever the residual of the solve.
//
// A drag holds nothing: its surfel is material in front of an edge that cuts, and `along` the way of it.
// Its impulse is l along, with s = -along.u the speed at which the edge moves through the material:
//
//     0 <= l <= most;   l = most where s > 0, s = 0 where 0 < l < most, s <= 0 where l = 0;   l s <= max_work
//
// which is dry friction that stops a motion, begins none, does at most the work `max_work`. Both sides get
// the impulse at the same point, so that the material is dragged by what the edge feels.
#pragma once
#include <cstdint>

#include "core/memory.h"
#include "math/vec3.h"

namespace dfm {

// Nodes are world-wide surfel numbers (contact_set.h). The first is the surfel, of weight 1; the others
// belong to body b, and their weights sum to -1.
struct Bond {
  uint32_t slot_a, slot_b;  // slot_b: obstacle slot where obstacle != 0
  uint8_t obstacle, nnode;
  uint32_t node[5];
  double weight[5];
  Vec3 velocity;    // m/s of the place on an obstacle, mean over the sub-step; 0 for bodies
  Vec3 rate;        // m/s
  double soft;      // 1/kg
  double softness;  // share of the surfel's own response that is added to soft
  // A drag's direction, unit length, its limit, N s, and its work, J. Otherwise `along` is zero.
  Vec3 along;
  double most, max_work;
  bool drags() const { return along.x != 0 || along.y != 0 || along.z != 0; }
};

}  // namespace dfm
