// Which features of one surface may touch each other: lists with a skin, as for two bodies (broad_phase.h),
// of a tree against itself.
//
// There are two differences. A rigid motion of all surfels brings no two of them together, so displacements
// and speeds are measured relative to the rigid motion that fits best: a body that falls or rolls keeps its
// lists. And features that share a surfel are no pair, because they always touch.
//
// If few surfels have moved far, or a cut has changed part of the surface, only pairs with one of those
// surfels are searched again. The lists then refer to positions of different times. They are still complete,
// because the rule holds for any reference positions: pairs that were near at the reference positions are
// listed, and displacements are measured from there (doc/decisions/detection_and_guard.md).
#pragma once
#include <algorithm>
#include <cmath>

#include "body/feature_map.h"
#include "body/self_rest.h"
#include "broad/rigid_fit.h"
#include "core/memory.h"
#include "geometry/surface.h"
#include "geometry/tree_walk.h"
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
  // Continues the lists of a surface from before a cut. moved [nsurfel]: surfels that are not where they
  // were; features that the cut has made need no mark. Before the first update().
  void follow(const SelfList &before, const FeatureMap &features, std::span<const uint8_t> moved);
  // In place of update(): whether no two features without a common corner are within reach of a contact in
  // this sub-step. Then nothing need be listed, and most calls compare one number. speed: m/s, no surfel is
  // faster; infinite: not known.
  bool far(double h, double offset, double speed);
  // After far() of the same sub-step, which was true: whether they stay apart as cover() has it; else the
  // lists are as after it.
  bool stays_far(double h, double offset, double change);
  // m: a pair whose `apart` is not less is out of reach of a contact. After update(), at the same positions.
  double within(double h, double offset) const;
  // m/s: no surfel was faster than that at the last update() or far(), beyond a rigid motion.
  double deforming() const { return motion_.speed; }
  // How often the lists were built, whole or in part.
  uint64_t renewals() const { return renewals_; }
  uint64_t parts() const { return parts_; }  // how often in part
  // f(other) for triangles whose boxes may meet that of this one now, and for itself.
  template <class F>
  void near_triangle(uint32_t triangle, F &&f) {
    const Box own = triangle_box(&surface_.tri[3 * size_t{triangle}], at_.x().data());  // as the tree has it
    const double margin = kDistanceRounding * 2 * moved_, limit = margin * margin;
    near_triangles(tree_, [&](const Box &b) { return box_distance2(own, b) <= limit; }, f);
  }
  // Ascending by (a, b).
  const Array<SelfPair> &vertex_face() const { return vf_; }
  const Array<SelfPair> &edge_edge() const { return ee_; }
  // m: every pair that is nearer than this now is listed. After update(), at the same positions.
  double covered() const { return limit_ - kDistanceRounding * 2 * moved_; }

 private:
  static constexpr double kDistanceRounding = 1 + 1e-9;  // margins hold in spite of rounded distances
  double share(double h, double offset, double growth) const;
  double covers(double h, double offset, double change) const;
  void renew(double h, double offset, double change);
  bool renew_part(double h, double offset, double change);
  void mark_features();
  void place();
  void find_least();
  bool beyond(double reach) const;
  void list(double limit);
  void list_anew(double limit);
  template <class Wanted>
  void add(uint32_t a, uint32_t b, double limit, const Wanted &wanted);
  const Surface &surface_;
  double margin_ = -1;  // m; negative: no lists yet
  BoxTree tree_;
  RigidReference at_;               // positions that the lists refer to
  double longest_ = 0, moved_ = 0;  // m, edge of that time; what displaced() said at the last update()
  Array<double> x_;                 // [nsurfel,4] positions then
  double limit_ = 0;                // m, with which the lists were built
  // m, every pair was as far apart at the positions to which the lists refer; is so now
  double least_ = 0, left_ = -1;
  DeformingMotion motion_;
  uint64_t renewals_ = 0, parts_ = 0;
  Array<SelfPair> vf_, ee_;
  // surfels, edges, triangles whose pairs are found anew; `begun`: follow() has marked some
  Array<uint8_t> anew_[3];
  bool begun_ = false;
  Array<SelfPair> scratch_;
  Array<PairOfTriangles> stack_;
};

}  // namespace dfm
