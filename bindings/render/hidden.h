// Solids that hide a body from the camera.
#pragma once
#include <vector>

#include "geometry.h"

namespace render {

// How much of itself a solid shows so that the bodies behind it can be seen: 1 where it hides none, and less
// the more it hides of one, from most of it on. It changes as smoothly as the bodies move.
class Hidden {
 public:
  Hidden(const Scene &scene, const Vec &eye);
  float shown(const Box &box) const;
  float shown(const Sphere &sphere) const;
  float shown(const Capsule &capsule) const;

 private:
  template <class Hides>
  float shown_if(Hides hides) const;
  Vec eye_;
  std::vector<std::vector<Vec>> places_;  // of each surface
};

}  // namespace render
