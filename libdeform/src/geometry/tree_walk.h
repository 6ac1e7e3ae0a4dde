// Walks through a tree of boxes, without memory of their own.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "geometry/box_tree.h"
#include "geometry/triangle_search.h"

namespace dfm {

inline constexpr uint32_t kDepth = 64;       // of a tree of 2^32 triangles it is 30
inline constexpr double kRaySlack = 1e-8;    // of all lengths: how far a triangle's box is widened for rays
inline constexpr double kParallel = 1e-300;  // components of a direction whose inverse would overflow

// The largest coordinate of any difference in a search from p.
inline double length_scale(const BoxTree &tree, Vec3 p) {
  const Box &root = tree.root();
  double far = norm(p);
  for (int k = 0; k < 3; ++k) far = std::max({far, std::fabs(root.lo[k]), std::fabs(root.hi[k])});
  return far;
}

// bound(box): nothing in the box has a lower value. leaf(first, last) looks at triangles by their place and
// lowers `limit`.
template <class Bound, class Leaf>
void nearest_first(const BoxTree &tree, const double &limit, uint64_t &nodes, Bound &&bound, Leaf &&leaf) {
  struct Waiting {
    uint32_t node;
    double bound;
  } stack[kDepth];
  uint32_t n = 0;
  const auto wait = [&](const Waiting &w) {
    if (w.bound < kFar && w.bound <= limit) stack[n++] = w;
  };
  ++nodes;
  wait({0, bound(tree.boxes()[0])});
  while (n > 0) {
    const Waiting w = stack[--n];
    if (!(w.bound <= limit)) continue;
    const BoxTree::Node node = tree.nodes()[w.node];
    if (node.count) {
      leaf(node.right, node.right + node.count);
      continue;
    }
    Waiting near{w.node + 1, bound(tree.boxes()[w.node + 1])};
    Waiting far{node.right, bound(tree.boxes()[node.right])};
    nodes += 2;
    if (far.bound < near.bound) std::swap(near, far);
    wait(far);
    wait(near);
  }
}

// A ray and the boxes that it meets. Differences and products with the same factor keep their order when they
// are rounded, so a box in another one is never met before it.
class RayBoxes {
 public:
  // slack: m, by which boxes are wider along each axis
  RayBoxes(Vec3 o, Vec3 d, Vec3 slack) : o_(o), slack_(slack) {
    for (int k = 0; k < 3; ++k) inverse_[k] = std::fabs(d[k]) < kParallel ? 0 : 1 / d[k];
  }
  struct Span {
    double near;
    double far;
  };
  // The part of the line in the widened box; near above far: it misses.
  Span meet(const Box &b) const {
    Span s{0, kFar};
    for (int k = 0; k < 3; ++k) {
      const double lo = b.lo[k] - slack_[k] - o_[k], hi = b.hi[k] + slack_[k] - o_[k];
      if (inverse_[k] == 0) {
        if (lo > 0 || hi < 0) return {kFar, 0};
        continue;
      }
      const double a = lo * inverse_[k], c = hi * inverse_[k];
      s.near = std::max(s.near, std::min(a, c));
      s.far = std::min(s.far, std::max(a, c));
    }
    return s;
  }
  double first(const Box &b) const {
    const Span s = meet(b);
    return s.near <= s.far ? s.near : kFar;
  }

 private:
  Vec3 o_;
  Vec3 inverse_;
  Vec3 slack_;
};

// f(place) for the triangles whose boxes pass near(const Box &), in the order of the leaves; ends where f
// returns false. Did it get to the end?
template <class N, class F>
bool walk(const BoxTree &tree, N &&near, F &&f) {
  if (tree.empty()) return true;
  uint32_t stack[kDepth], n = 0;
  stack[n++] = 0;
  while (n > 0) {
    const uint32_t i = stack[--n];
    if (!near(tree.boxes()[i])) continue;
    const BoxTree::Node node = tree.nodes()[i];
    if (!node.count) {
      stack[n++] = node.right;
      stack[n++] = i + 1;
      continue;
    }
    for (uint32_t p = node.right; p < node.right + node.count; ++p)
      if (near(tree.triangle_boxes()[p]) && !f(p)) return false;
  }
  return true;
}

// f(triangle) for all of them.
template <class N, class F>
void near_triangles(const BoxTree &tree, N &&near, F &&f) {
  walk(tree, near, [&](uint32_t place) {
    f(tree.triangles()[place]);
    return true;
  });
}

}  // namespace dfm
