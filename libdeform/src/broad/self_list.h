// Which features of one surface may touch each other: lists with a skin, as those of two bodies
// (broad_phase.h), of a tree against itself.
//
// Two differences. A rigid motion of all surfels brings no two of them together, so displacements and speeds
// are taken against the one that fits best: a body that falls or rolls keeps its lists. And features that
// share a surfel are no pair: they always touch.
#pragma once
#include "body/self_rest.h"
#include "broad/rigid_fit.h"
#include "core/memory.h"
#include "geometry/box_tree.h"
#include "geometry/surface.h"
#include "math/vec3.h"

namespace dfm {

class SelfList {
 public:
  SelfList(const Memory &memory, const Surface &surface);

  // Updates what is out of date; returns true if the lists changed. h in s; offset d_c in m. Results never
  // depend on when lists were built.
  bool update(double h, double offset);
  // After update(), at the same positions: the same lists, rebuilt if they do not cover the motion of the
  // sub-step after its solve. change: m/s, largest change of a surfel's velocity by the solve.
  bool cover(double h, double offset, double change);
  // m/s: no surfel was faster than that at the last update(), beyond the rigid motion that fits best.
  double deforming() const { return motion_.speed; }
  // How often the lists were built.
  uint64_t renewals() const { return renewals_; }
  // f(triangle, triangle) for pairs whose boxes may meet now; each pair once.
  template <class F>
  void near_triangles(F &&f) {
    near_self_pairs(tree_, kDistanceRounding * 2 * moved_, stack_,
                    [&](uint32_t p, uint32_t q, double) { f(tree_.triangles()[p], tree_.triangles()[q]); });
  }
  // Ascending by (a, b).
  const Array<SelfPair> &vertex_face() const { return vf_; }
  const Array<SelfPair> &edge_edge() const { return ee_; }
  // m: every pair that is nearer than this now is listed. After update(), at the same positions.
  double covered() const { return limit_ - kDistanceRounding * 2 * moved_; }
  // Wide: the next rebuild uses the widest skin, independent of the motion; for a body that may touch itself
  // later, whose list is not traversed.
  void set_wide(bool wide) { wide_ = wide; }
  // The skin is made to last for about this many sub-steps of the present motion.
  void set_skin_steps(double steps) { skin_steps_ = steps; }

 private:
  static constexpr double kDistanceRounding = 1 + 1e-9;  // margins hold in spite of rounded distances
  double share(double h, double offset, double growth) const;
  double covers(double h, double offset, double change) const;
  void renew(double h, double offset, double change);
  void list(double limit);
  const Surface &surface_;
  double skin_steps_ = 24, margin_ = -1;  // negative: no lists yet
  BoxTree tree_;
  RigidReference at_;               // when the lists were made
  double longest_ = 0, moved_ = 0;  // m, edge of that time; what displaced() said at the last update()
  double limit_ = 0;                // m, with which the lists were built
  bool wide_ = false;
  DeformingMotion motion_;
  uint64_t renewals_ = 0;
  Array<SelfPair> vf_, ee_;
  Array<PairOfTriangles> stack_;
};

}  // namespace dfm
