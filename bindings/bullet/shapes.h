// What soft bodies see of a collision object: the leaves of its shape.
#pragma once
#include <vector>

#include "opened.h"
#include "rigid_host/triangles.h"

namespace dfm_bullet_detail {

// One leaf, with all properties that its obstacle follows from. Compared in each step, so without arrays.
struct Part {
  const btCollisionShape *shape = nullptr;
  int type = -1, revision = 0;
  double size[3] = {}, scaling[3] = {};
  Pose local;  // in the object's frame
  bool operator==(const Part &o) const;
};
// The leaves of a shape, compounds opened. false: `unknown` is a kind that soft bodies cannot touch.
bool parts_of(const btCollisionShape *shape, const Pose &local, std::vector<Part> &out,
              const btCollisionShape *&unknown);

// True: these are the present leaves of the shape. False: only parts_of() can decide. A quick test for the
// sphere, box or capsule that most bodies have.
bool is_still(const btCollisionShape *shape, const std::vector<Part> &parts);

// The leaf's kind, sizes and local pose. Arrays that are made here are put in `made`, and def points into
// them. The pose in def is that of the leaf in the object's frame.
void describe(const Part &part, dfm_obstacle_def &def, Pose &local, Triangles &made);

}  // namespace dfm_bullet_detail
