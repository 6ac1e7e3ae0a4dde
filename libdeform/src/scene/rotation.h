// Rotations of a scene, from an axis and an angle in degrees or from a direction.
#pragma once
#include "math/turn.h"

namespace dfm::scene {

inline constexpr double kRadian = 0.017453292519943295;  // of a degree
inline constexpr double kWidest = 3 / kRadian;           // degrees, of an opening: 3 rad, as in tool.h

// axis need not be unit, but not zero. Multiples of 90 degrees come out to the last bit, and the same on
// every machine: libm's sine is not used, since its last bit depends on the processor and the start state
// decides the state hash.
Quat rotation(const double axis[3], double angle_deg);
Quat rotation_to(const double direction[3]);  // the shortest turn of (0,0,1) onto a direction
// Start states have the rounding of this order of operations, which is not that of dfm::rotate.
void rotate(Quat q, const double v[3], double out[3]);

}  // namespace dfm::scene
