// Multibodies of a world at the start of a sub-step, for sub-steps that are taken back.
#pragma once
#include <vector>

#include "opened.h"

namespace dfm_bullet_detail {

class MultiState {
 public:
  void keep(btDiscreteDynamicsWorld &world);
  void restore();
  bool any() const { return count_ > 0; }

 private:
  struct Kept {
    btMultiBody *body;
    btVector3 place;
    btQuaternion rotation;
    std::vector<btScalar> velocities, joints;  // base and links; of all links, in their order
  };
  std::vector<Kept> kept_;
  size_t count_ = 0;  // of kept_ in use
  btAlignedObjectArray<btQuaternion> rotations_;
  btAlignedObjectArray<btVector3> origins_;
};

}  // namespace dfm_bullet_detail
