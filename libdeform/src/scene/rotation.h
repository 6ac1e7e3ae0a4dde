// Unit quaternions (x, y, z, w) of a scene: from an axis and an angle in degrees, and the few products that
// placing needs.
#pragma once
namespace dfm::scene {

struct Quaternion { double x = 0, y = 0, z = 0, w = 1; };

// axis need not be unit, but not zero. Multiples of 90 degrees come out to the last bit, and the same on
// every machine: libm's sine is not used, since its last bit depends on the processor and the start state
// decides the state hash.
Quaternion rotation(const double axis[3], double angle_deg);
Quaternion rotation_to(const double direction[3]);  // the shortest turn of (0,0,1) onto a direction
Quaternion multiply(const Quaternion &a, const Quaternion &b);
void rotate(const Quaternion &q, const double v[3], double out[3]);

}  // namespace dfm::scene
