// The winding number of a triangle surface around a point: 1 inside, 0 outside, and in between if the surface
// has holes or wrongly oriented triangles (Jacobson, Kavan and Sorkine-Hornung 2013). The contribution of a
// distant box of triangles is approximated by a dipole with its first correction (Barill, Dickson, Schmidt,
// Levin and Jacobson 2018). Set-up code.
#pragma once
#include <cstdint>

#include "core/memory.h"
#include "math/vec3.h"

namespace dfm {

// A tree is used from a distance of kFarWinding radii of a box; nearer, its triangles' solid angles are
// summed exactly. The error of the sum is below 0.05 on every surface measured
// (tests/unit/geometry/winding_test.cpp), where the decision at 1/2 needs less than 1/4.
inline constexpr double kFarWinding = 2.5;

class WindingTree {
 public:
  // points [.,3], tris [ntri,3]. Lengths should be of order one: cubes of distances are formed.
  WindingTree(const Memory &memory, const double *points, uint32_t ntri, const uint32_t *tris);
  // By the tree. Near triangles whose unit vectors to the corners have a triple product of at most `flat`
  // count 0: those in whose plane the place lies.
  double at(Vec3 place, double flat = -1) const;
  double exactly_at(Vec3 place) const;  // the sum over all triangles

 private:
  struct Box {
    Vec3 center, area;         // area-weighted center; sum of the triangles' area vectors
    double moment[3][3] = {};  // sum of (triangle's center - center) x area vector
    double reach = 0;          // farthest corner from the center
    uint32_t begin, end;       // triangles
    uint32_t right;            // second child; the first is the next box. 0: a leaf
  };
  void sum_up(Box &box) const;

  Array<Box> boxes_;
  Array<Vec3> corners_;  // [ntri,3] in the order of the boxes
};

}  // namespace dfm
