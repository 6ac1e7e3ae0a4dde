// A tree of boxes over things at rest (points, cells, supports), for the construction of couplings. Built
// once, never changed.
#pragma once
#include <algorithm>
#include <cstdint>

#include "core/memory.h"
#include "math/vec3.h"

namespace dfm {

struct RestBox { Vec3 lo, hi; };

// Splits at the median along the longest extent of the box centers, items ordered by (center, number): the
// tree depends on its input alone.
class RestTree {
 public:
  RestTree(const Memory &memory, const Array<RestBox> &boxes);

  // Calls visit(item) for every item whose box holds p, in no promised order.
  template <class F>
  void holding(Vec3 p, F &&visit) const {
    walk(0, [&](const RestBox &b) { return distance2(b, p) <= 0; }, visit);
  }
  // Calls visit(item) for every item whose box is no further from p than sqrt(limit2); visit
  // may lower limit2.
  template <class F>
  void near(Vec3 p, const double &limit2, F &&visit) const {
    if (!node_.empty()) near_node(0, p, limit2, visit);
  }

 private:
  // items [begin,end); children: the next node and `right`; a leaf has right 0
  struct Node {
    RestBox box;
    uint32_t begin, end, right;
  };
  static constexpr uint32_t kLeaf = 4;
  Array<Node> node_;
  Array<uint32_t> item_;
  const Array<RestBox> &box_;

  uint32_t build(uint32_t begin, uint32_t end);
  static double distance2(const RestBox &b, Vec3 p) {
    const auto outside = [](double lo, double hi, double x) { return std::max({lo - x, x - hi, 0.0}); };
    return norm2({outside(b.lo.x, b.hi.x, p.x), outside(b.lo.y, b.hi.y, p.y), outside(b.lo.z, b.hi.z, p.z)});
  }
  template <class Enter, class F>
  void walk(uint32_t n, const Enter &enter, F &visit) const {
    if (n >= node_.size() || !enter(node_[n].box)) return;
    if (node_[n].right) {
      walk(n + 1, enter, visit);
      return walk(node_[n].right, enter, visit);
    }
    for (uint32_t i = node_[n].begin; i < node_[n].end; ++i)
      if (enter(box_[item_[i]])) visit(item_[i]);
  }
  template <class F>
  void near_node(uint32_t n, Vec3 p, const double &limit2, F &visit) const {
    const Node &node = node_[n];
    if (!node.right) {
      for (uint32_t i = node.begin; i < node.end; ++i)
        if (distance2(box_[item_[i]], p) <= limit2) visit(item_[i]);
      return;
    }
    const double left = distance2(node_[n + 1].box, p), right = distance2(node_[node.right].box, p);
    const uint32_t first = right < left ? node.right : n + 1, second = right < left ? n + 1 : node.right;
    if (std::min(left, right) <= limit2) near_node(first, p, limit2, visit);
    if (std::max(left, right) <= limit2) near_node(second, p, limit2, visit);
  }
};

}  // namespace dfm
