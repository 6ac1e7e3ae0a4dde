#include "geometry/box_tree.h"

#include <algorithm>

#include "math/extent.h"

namespace dfm {
namespace {

constexpr double kQualityLimit = 2;  // rebuild the tree when the sum of the boxes has grown by this factor

void join(Box &a, const Box &b) {
  for (int k = 0; k < 4; ++k) {
    a.lo[k] = b.lo[k] < a.lo[k] ? b.lo[k] : a.lo[k];
    a.hi[k] = b.hi[k] > a.hi[k] ? b.hi[k] : a.hi[k];
  }
}

double half_area(const Box &b) {
  const double x = b.hi[0] - b.lo[0], y = b.hi[1] - b.lo[1], z = b.hi[2] - b.lo[2];
  return x * y + y * z + z * x;
}

}  // namespace

Box triangle_box(const uint32_t *corner, const double *x) {
  const double *a = x + 4 * size_t{corner[0]}, *b = x + 4 * size_t{corner[1]}, *c = x + 4 * size_t{corner[2]};
  Box box;
  for (int k = 0; k < 4; ++k) {
    const double lo = a[k] < b[k] ? a[k] : b[k], hi = a[k] > b[k] ? a[k] : b[k];
    box.lo[k] = lo < c[k] ? lo : c[k];
    box.hi[k] = hi > c[k] ? hi : c[k];
  }
  return box;
}

BoxTree::BoxTree(const Memory &memory) { use_memory(memory, node_, box_, tri_box_, tri_, centroid_); }

// Allocates all memory first: if an allocation fails, the tree is unchanged, with matching nodes and boxes.
void BoxTree::build(std::span<const uint32_t> corners, const double *x) {
  const uint32_t ntri = uint32_t(corners.size() / 3);
  const size_t leaves = (size_t{ntri} + kLeaf - 1) / kLeaf, nodes = leaves ? 2 * leaves - 1 : 0;
  node_.reserve(nodes);
  box_.reserve(nodes);
  tri_.reserve(ntri);
  tri_box_.reserve(ntri);
  centroid_.reserve(ntri);
  node_.clear();
  centroid_.resize(ntri);
  for (uint32_t t = 0; t < ntri; ++t) {
    const Box b = triangle_box(&corners[3 * size_t{t}], x);
    for (int k = 0; k < 3; ++k) centroid_[t].x[k] = b.lo[k] + b.hi[k];
    centroid_[t].tri = t;
  }
  if (ntri) split(0, ntri);
  tri_.resize(ntri);
  for (uint32_t i = 0; i < ntri; ++i) tri_[i] = centroid_[i].tri;
  box_.resize(node_.size());
  tri_box_.resize(ntri);
  refit(corners, x);
  area_built_ = area_;
}

void BoxTree::take(const BoxTree &other) {
  node_.clear();  // no tree, should an allocation fail
  box_.assign(other.box_.begin(), other.box_.end());
  tri_box_.assign(other.tri_box_.begin(), other.tri_box_.end());
  tri_.assign(other.tri_.begin(), other.tri_.end());
  node_.assign(other.node_.begin(), other.node_.end());
  area_ = other.area_;
  area_built_ = other.area_built_;
}

bool BoxTree::renew(std::span<const uint32_t> corners, const double *x) {
  if (!empty()) refit(corners, x);
  if (!empty() && quality() <= kQualityLimit) return false;
  build(corners, x);
  return true;
}

// Splits at the median of the longest axis; ties by triangle number, so that which triangles a leaf has
// depends on the input alone.
uint32_t BoxTree::split(uint32_t begin, uint32_t end) {
  const uint32_t self = uint32_t(node_.size());
  if (end - begin <= kLeaf) {
    node_.push_back({begin, end - begin});
    return self;
  }
  Extent box;
  for (uint32_t i = begin; i < end; ++i) box.add(load3(centroid_[i].x));
  const int axis = box.longest_axis();
  // Full leaves: the left half takes a multiple of the leaf's size.
  const uint32_t leaves = (end - begin + kLeaf - 1) / kLeaf, middle = begin + (leaves + 1) / 2 * kLeaf;
  std::nth_element(centroid_.begin() + begin, centroid_.begin() + middle, centroid_.begin() + end,
                   [axis](const Centroid &l, const Centroid &r) {
                     return l.x[axis] != r.x[axis] ? l.x[axis] < r.x[axis] : l.tri < r.tri;
                   });
  node_.push_back({0, 0});
  split(begin, middle);
  const uint32_t right = split(middle, end);
  node_[self].right = right;
  return self;
}

void BoxTree::refit(std::span<const uint32_t> corners, const double *x) {
  area_ = 0;
  for (uint32_t i = 0; i < tri_.size(); ++i) tri_box_[i] = triangle_box(&corners[3 * size_t{tri_[i]}], x);
  for (uint32_t i = uint32_t(node_.size()); i-- > 0;) {
    const Node n = node_[i];
    Box box;
    if (n.count) {
      box = tri_box_[n.right];
      for (uint32_t k = 1; k < n.count; ++k) join(box, tri_box_[n.right + k]);
    } else {
      box = box_[i + 1];
      join(box, box_[n.right]);
    }
    box_[i] = box;
    area_ += half_area(box);
  }
}

void near_nodes(const BoxTree &a, const BoxTree &b, double margin, size_t wanted,
                Array<PairOfTriangles> &out) {
  const double limit = margin * margin;
  const auto near = [&](PairOfTriangles p) { return box_distance2(a.boxes()[p.a], b.boxes()[p.b]) <= limit; };
  out.clear();
  if (a.empty() || b.empty() || !near({0, 0})) return;
  out.push_back({0, 0});
  // one after the other is divided, until a whole round has found leaves alone
  for (size_t at = 0, leaves = 0; !out.empty() && out.size() < wanted && leaves < out.size();) {
    at %= out.size();
    const auto [i, j] = out[at];
    const BoxTree::Node m = a.nodes()[i], n = b.nodes()[j];
    if (m.count && n.count) {
      ++leaves;
      ++at;
      continue;
    }
    leaves = 0;
    const bool first = n.count || (!m.count && m.right - i >= n.right - j);
    const PairOfTriangles left = first ? PairOfTriangles{i + 1, j} : PairOfTriangles{i, j + 1};
    const PairOfTriangles right = first ? PairOfTriangles{m.right, j} : PairOfTriangles{i, n.right};
    if (near(left)) {
      out[at++] = left;
      if (near(right)) out.push_back(right);
    } else if (near(right)) {
      out[at++] = right;
    } else {
      out[at] = out.back();
      out.pop_back();
    }
  }
}

}  // namespace dfm
