// Binary tree of boxes over triangles. Its topology is found once by median splits; later only its boxes are
// refitted bottom-up, and it is rebuilt when they have grown too much.
#pragma once
#include <cstdint>
#include <span>

#include "core/memory.h"
#include "math/vec3.h"

namespace dfm {

struct alignas(64) Box {
  double lo[4], hi[4];  // fourth component 0
};

// Squared distance of two boxes; 0 where they overlap. Two lanes at a time: this is the inner loop of
// every descent.
inline double box_distance2(const Box &a, const Box &b) {
  using Two = double __attribute__((vector_size(16)));
  const Two *al = reinterpret_cast<const Two *>(a.lo), *ah = reinterpret_cast<const Two *>(a.hi);
  const Two *bl = reinterpret_cast<const Two *>(b.lo), *bh = reinterpret_cast<const Two *>(b.hi);
  const Two zero = {0, 0};
  Two sum = zero;
  for (int k = 0; k < 2; ++k) {
    const Two g = al[k] - bh[k], e = bl[k] - ah[k];
    Two d = g > e ? g : e;
    d = d > zero ? d : zero;
    sum += d * d;
  }
  return sum[0] + sum[1];
}

Box triangle_box(const uint32_t *corner, const double *x);  // x: [points,4]

struct PairOfTriangles {
  uint32_t a, b;  // nodes of two trees
};

class BoxTree {
 public:
  static constexpr uint32_t kLeaf = 8;  // triangles in a leaf, at most
  struct Node {
    // inner: the left child is the next node, this is the right one; leaf: first place in triangle()
    uint32_t right;
    uint32_t count;  // 0: inner
  };
  explicit BoxTree(const Memory &memory);

  // corners: [ntri,3]; x: [points,4]
  void build(std::span<const uint32_t> corners, const double *x);
  void refit(std::span<const uint32_t> corners, const double *x);
  // Refits the boxes; builds the tree if there is none or its boxes have grown too much. Returns whether it
  // was built.
  bool renew(std::span<const uint32_t> corners, const double *x);
  // Takes the topology of a tree over the same triangles.
  void take(const BoxTree &other);
  // Sum of the boxes' areas over its value after build().
  double quality() const { return area_built_ > 0 ? area_ / area_built_ : 1; }

  bool empty() const { return node_.empty(); }
  const Box &root() const { return box_[0]; }
  const Array<Node> &nodes() const { return node_; }
  const Array<Box> &boxes() const { return box_; }
  const Array<uint32_t> &triangles() const { return tri_; }  // in the order of the leaves
  const Array<Box> &triangle_boxes() const { return tri_box_; }

 private:
  struct Centroid {
    double x[3];
    uint32_t tri;
  };
  uint32_t split(uint32_t begin, uint32_t end);
  Array<Node> node_;
  Array<Box> box_, tri_box_;
  Array<uint32_t> tri_;
  Array<Centroid> centroid_;
  double area_ = 0, area_built_ = 0;
};

// Pairs of nodes, no further apart than margin, below which all such pairs of triangles lie, each in one of
// them: as many as wanted if the trees are deep enough.
void near_nodes(const BoxTree &a, const BoxTree &b, double margin, size_t wanted,
                Array<PairOfTriangles> &out);

// f(place in a, place in b, squared distance of the boxes) for all triangles whose boxes are no further apart
// than margin; places count in the order of the leaves. stack is scratch. from: two nodes; only
// triangles below them are tested.
template <class F>
void near_pairs(const BoxTree &a, const BoxTree &b, double margin, Array<PairOfTriangles> &stack, F &&f,
                PairOfTriangles from = {0, 0}) {
  if (a.empty() || b.empty()) return;
  const double limit = margin * margin;
  stack.clear();
  stack.push_back(from);
  while (!stack.empty()) {
    const auto [i, j] = stack.back();
    stack.pop_back();
    if (!(box_distance2(a.boxes()[i], b.boxes()[j]) <= limit)) continue;
    const BoxTree::Node m = a.nodes()[i], n = b.nodes()[j];
    if (m.count && n.count) {
      uint32_t near_a[BoxTree::kLeaf], count = 0;
      for (uint32_t q = n.right; q < n.right + n.count; ++q)
        if (box_distance2(a.boxes()[i], b.triangle_boxes()[q]) <= limit) near_a[count++] = q;
      for (uint32_t p = m.right; count && p < m.right + m.count; ++p) {
        if (!(box_distance2(a.triangle_boxes()[p], b.boxes()[j]) <= limit)) continue;
        for (uint32_t k = 0; k < count; ++k)
          if (const double d2 = box_distance2(a.triangle_boxes()[p], b.triangle_boxes()[near_a[k]]);
              d2 <= limit)
            f(p, near_a[k], d2);
      }
    } else if (n.count || (!m.count && m.right - i >= n.right - j)) {
      // the left child of a larger node first: its extent in the array is the measure of its size
      stack.push_back({i + 1, j});
      stack.push_back({m.right, j});
    } else {
      stack.push_back({i, j + 1});
      stack.push_back({i, n.right});
    }
  }
}

// The same of a tree with itself: each pair of different triangles once.
template <class F>
void near_self_pairs(const BoxTree &tree, double margin, Array<PairOfTriangles> &stack, F &&f) {
  if (tree.empty()) return;
  const double limit = margin * margin;
  const auto meet = [&](uint32_t p, uint32_t q) {
    if (const double d2 = box_distance2(tree.triangle_boxes()[p], tree.triangle_boxes()[q]); d2 <= limit)
      f(p, q, d2);
  };
  stack.clear();
  stack.push_back({0, 0});
  while (!stack.empty()) {
    const auto [i, j] = stack.back();
    stack.pop_back();
    const BoxTree::Node m = tree.nodes()[i], n = tree.nodes()[j];
    if (i == j) {
      for (uint32_t p = m.right; p < m.right + m.count; ++p)
        for (uint32_t q = p + 1; q < m.right + m.count; ++q) meet(p, q);
      if (!m.count) {
        stack.push_back({i + 1, i + 1});
        stack.push_back({m.right, m.right});
        stack.push_back({i + 1, m.right});
      }
      continue;
    }
    if (!(box_distance2(tree.boxes()[i], tree.boxes()[j]) <= limit)) continue;
    if (m.count && n.count) {
      for (uint32_t p = m.right; p < m.right + m.count; ++p)
        if (box_distance2(tree.triangle_boxes()[p], tree.boxes()[j]) <= limit)
          for (uint32_t q = n.right; q < n.right + n.count; ++q) meet(p, q);
    } else if (n.count || (!m.count && m.right - i >= n.right - j)) {
      stack.push_back({i + 1, j});
      stack.push_back({m.right, j});
    } else {
      stack.push_back({i, j + 1});
      stack.push_back({i, n.right});
    }
  }
}

}  // namespace dfm
