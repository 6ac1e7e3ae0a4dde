// Creating, ending and reporting attachments between two steps (deform/attach.h).
#pragma once
#include <cstdint>

#include "deform/attach.h"
#include "state/attachment.h"
#include "state/body.h"
#include "state/obstacle.h"

namespace dfm {

// A place on a body: three corners of a triangle, and one surfel off its plane or with weight 0.
struct Place {
  uint32_t node[kAnchors];
  double weight[kAnchors];
};
// Weights for the point x, from corners and weights that sum to 1 without the fourth. They give every linear
// field: a point attached at a small distance then rotates with the surface, and forces on it conserve
// angular momentum.
void lift(const Body &b, Vec3 x, Place &p);

// Returns the number of the new attachment. One of `other` and `obstacle` is null. Throws Error; then nothing
// has changed.
uint32_t attach(Body &b, const dfm_attach_def &def, Body *other, const Obstacle *obstacle);
void detach(Body &b, uint32_t number);
dfm_attachment attachment_report(const Body &b, uint32_t number);

}  // namespace dfm
