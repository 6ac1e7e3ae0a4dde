// Random numbers of a scene, and small random displacements of the start state.
#pragma once
#include "deform/deform.h"

namespace dfm::scene {

// Small displacements of the start state, the same on every machine for the same seed: each body in turn
// draws 10 numbers.
class Jitter {
 public:
  explicit Jitter(uint64_t seed) : state_(seed) {}
  double symmetric();  // in [-1, 1)
  // Positions +-1e-3 of `size`, angle +-0.5 degrees about an axis through `center` (rest frame),
  // velocities +-1 %.
  void apply(double size, const double center[3], dfm_pose &pose, double velocity[3], double spin[3]);

 private:
  uint64_t state_;
};

}  // namespace dfm::scene
