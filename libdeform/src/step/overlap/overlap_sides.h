// One side of an overlap search: a surface in place, with a test for inside and outside. Set-up code.
#pragma once
#include <memory>
#include <vector>

#include "geometry/box_tree.h"
#include "geometry/obstacle_shape.h"
#include "geometry/winding.h"
#include "state/body.h"
#include "state/obstacle.h"

namespace dfm {

struct StepContext;
struct World;

// A surface of triangles: a body's, or that of a mesh, voxels or a box.
class OverlapSkin {
 public:
  OverlapSkin(const Memory &memory, const Body &b);
  OverlapSkin(const Memory &memory, const Obstacle &o);

  uint32_t nsurfel() const { return surface_->nsurfel; }
  const Surface &surface() const { return *surface_; }
  Vec3 x(uint32_t s) const { return load3(&x_[4 * size_t{s}]); }
  Vec3 corner(uint32_t t, int k) const { return x(surface_->tri[3 * size_t{t} + size_t(k)]); }
  Vec3 lo() const { return lo_; }
  Vec3 hi() const { return hi_; }
  // middles of cells, of a body: on no surface, and inside its own where covers() says so
  const std::vector<Vec3> &inner() const { return inner_; }
  // m, difference between its triangles and the surface for contact (voxels)
  double slack() const { return slack_; }
  bool room() const { return closed_ && !outward_; }  // material is outside its triangles

  const BoxTree &tree();
  bool inside(Vec3 p);  // in its material; never in an open surface's
  // Whether the middle of one of its cells is within its surface. Cells that a separate surface only grazes
  // reach out of it, by up to their size where the body was filled.
  bool covers(Vec3 p);
  double distance(Vec3 p);  // m, to its surface
  void shift(Vec3 by);

 private:
  void finish();
  double turns(Vec3 p);  // winding number
  const Memory *memory_;
  Surface own_;
  const Surface *surface_;
  Array<double> x_;
  Vec3 lo_, hi_, origin_;
  double scale_ = 1, slack_ = 0;
  bool closed_ = true, outward_ = true;
  std::vector<Vec3> inner_;
  std::unique_ptr<BoxTree> tree_;
  std::unique_ptr<WindingTree> winding_;
};

// The result for two sides.
struct Crossed {
  uint32_t crossings = 0, enclosed = 0;
  double depth = 0;       // m
  bool through = false;   // deeper than the rest distance: more than touching
  bool coincide = false;  // no surface separates the sides
  bool mostly = false;    // more than half of the surfels of one side are inside the other
};
// `yes_or_no`: only `through` is needed.
Crossed cross_skins(OverlapSkin &a, OverlapSkin &b, double offset, bool yes_or_no,
                    Array<PairOfTriangles> &stack);
// Plane, sphere, capsule: in closed form.
Crossed cross_shape(OverlapSkin &a, const ObstacleShape &b, double offset);

struct OverlapPair {
  uint32_t a, b;  // slots
  bool obstacle;  // b is one
};

// Sides on demand, each made once.
class OverlapSides {
 public:
  explicit OverlapSides(World &w);
  OverlapSkin &body(uint32_t i);
  bool may_touch(const OverlapPair &p) const;  // ignoring exclusion
  // through: by more than `least`.
  Crossed look(const OverlapPair &p, double least, bool yes_or_no);

  // The shape of side b.
  ObstacleShape shape(const OverlapPair &p) const;
  bool plane(const OverlapPair &p) const;
  Vec3 center(const OverlapPair &p);
  double reach(const OverlapPair &p, Vec3 direction);  // m, its farthest point along a direction
  double slack(const OverlapPair &p);                  // m, OverlapSkin::slack()

 private:
  bool round(const OverlapPair &p) const;
  OverlapSkin &other(const OverlapPair &p);
  World &w_;
  const StepContext &step_;
  std::vector<std::unique_ptr<OverlapSkin>> bodies_, obstacles_;
  Array<PairOfTriangles> stack_;
};

}  // namespace dfm
