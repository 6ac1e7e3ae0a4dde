// The non-rigid part of the motion of a surface: only this part can bring parts of the surface together.
#pragma once
#include "core/memory.h"
#include "geometry/surface.h"
#include "math/vec3.h"

namespace dfm {

// Positions of a surface at one time, and the rotation that fits best since.
class RigidReference {
 public:
  explicit RigidReference(const Memory &memory) : x_(HookAllocator<double>(memory)) {}
  void set(const Surface &surface);
  // m, largest since set(), beyond the rigid motion that fits best
  double displaced(const Surface &surface);
  const Array<double> &x() const { return x_; }

 private:
  Array<double> x_;  // [nsurfel,4]
  Vec3 center_;      // of x_
  Quat turn_;        // best fit at the last call
};

// rad/s; m/s, largest beyond the rigid motion that fits best
struct DeformingMotion { double turn = 0, speed = 0; };
DeformingMotion deforming_motion(const Surface &surface, double h);
double longest_edge(const Surface &surface);  // m, now

}  // namespace dfm
