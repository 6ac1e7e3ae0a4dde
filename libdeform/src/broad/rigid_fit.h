// The non-rigid part of the motion of a surface: only this part can bring parts of the surface together.
#pragma once
#include <span>

#include "core/memory.h"
#include "geometry/surface.h"
#include "math/vec3.h"

namespace dfm {

// Positions of a surface at one time, and the rotation that fits best since.
class RigidReference {
 public:
  explicit RigidReference(const Memory &memory) : x_(memory) {}
  void set(const Surface &surface);
  // m, largest since set(), beyond the rigid motion that fits best
  double displaced(const Surface &surface);
  const Array<double> &x() const { return x_; }
  // Stores the present places of the surfels that are marked or have moved by more than `far` (m) beyond the
  // rigid motion that displaced() has found, and marks them. False: these are more than `most`, and set()
  // must follow.
  bool set_again(const Surface &surface, double far, uint32_t most, std::span<uint8_t> marked);
  // Continues `before` for a surface that a cut has remade. now: numbers of its surfels by those before, or
  // kNone; marked surfels are taken at their present places.
  void follow(const RigidReference &before, std::span<const uint32_t> now, const Surface &surface,
              std::span<const uint8_t> marked);

 private:
  Array<double> x_;  // [nsurfel,4]
  Vec3 center_;      // of x_
  Quat turn_;        // best fit at the last call
};

// rad/s; m/s, largest beyond the rigid motion that fits best
struct DeformingMotion { double turn = 0, speed = 0; };
DeformingMotion deforming_motion(const Surface &surface, double h);
// m, at the positions x [nsurfel,4]
double longest_edge(const Surface &surface, const double *x);

}  // namespace dfm
