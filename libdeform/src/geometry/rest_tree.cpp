#include "geometry/rest_tree.h"

#include "math/extent.h"

namespace dfm {

RestTree::RestTree(const Memory &memory, const Array<RestBox> &boxes)
    : node_(memory), item_(boxes.size(), 0u, memory), box_(boxes) {
  for (uint32_t i = 0; i < item_.size(); ++i) item_[i] = i;
  if (item_.empty()) return;
  node_.reserve(item_.size());
  build(0, static_cast<uint32_t>(item_.size()));
}

uint32_t RestTree::build(uint32_t begin, uint32_t end) {
  const auto center = [&](uint32_t i, int axis) { return 0.5 * box_[i].lo[axis] + 0.5 * box_[i].hi[axis]; };
  Extent box, centers;
  for (uint32_t i = begin; i < end; ++i) {
    const uint32_t own = item_[i];
    box.add(box_[own].lo);
    box.add(box_[own].hi);
    centers.add({center(own, 0), center(own, 1), center(own, 2)});
  }
  const uint32_t number = static_cast<uint32_t>(node_.size());
  node_.push_back({{box.lo, box.hi}, begin, end, 0});
  if (end - begin <= kLeaf) return number;
  const int axis = centers.longest_axis();
  const uint32_t mid = begin + (end - begin) / 2;
  std::nth_element(item_.begin() + begin, item_.begin() + mid, item_.begin() + end,
                   [&](uint32_t i, uint32_t j) {
                     const double a = center(i, axis), b = center(j, axis);
                     return a != b ? a < b : i < j;
                   });
  build(begin, mid);
  const uint32_t right = build(mid, end);
  node_[number].right = right;
  return number;
}

}  // namespace dfm
