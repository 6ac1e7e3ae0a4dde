// A tree of boxes over things at rest (points, cells, supports), for the construction of couplings. Built
// once, never changed: that of triangles (box_tree.h), each of them the diagonal of a box.
#pragma once
#include "geometry/tree_walk.h"
#include "math/extent.h"

namespace dfm {

class RestTree {
 public:
  // box(i): the Extent of the item i < n
  template <class F>
  RestTree(const Memory &memory, uint32_t n, F &&box) : tree_(memory) {
    Array<double> x{memory};
    Array<uint32_t> corner{memory};
    for (uint32_t i = 0; i < n; ++i) {
      const Extent b = box(i);
      x.insert(x.end(), {b.lo.x, b.lo.y, b.lo.z, 0, b.hi.x, b.hi.y, b.hi.z, 0});
      corner.insert(corner.end(), {2 * i, 2 * i, 2 * i + 1});
    }
    tree_.build(corner, x.data());
  }
  // Calls visit(item) for every item whose box holds p, in no promised order.
  template <class F>
  void holding(Vec3 p, F &&visit) const {
    near_triangles(tree_, [&](const Box &b) { return box_distance2(b, at(p)) <= 0; }, visit);
  }
  // Calls visit(item) for every item whose box is no further from p than sqrt(limit2); visit
  // may lower limit2.
  template <class F>
  void near(Vec3 p, const double &limit2, F &&visit) const {
    if (tree_.empty()) return;
    uint64_t nodes = 0;
    const Box own = at(p);
    nearest_first(
        tree_, limit2, nodes, [&](const Box &b) { return box_distance2(b, own); },
        [&](uint32_t first, uint32_t last) {
          for (; first < last; ++first)
            if (box_distance2(tree_.triangle_boxes()[first], own) <= limit2) visit(tree_.triangles()[first]);
        });
  }

 private:
  static Box at(Vec3 p) { return {{p.x, p.y, p.z, 0}, {p.x, p.y, p.z, 0}}; }
  BoxTree tree_;
};

}  // namespace dfm
