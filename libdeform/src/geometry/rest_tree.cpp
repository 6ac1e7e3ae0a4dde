#include "geometry/rest_tree.h"

namespace dfm {

RestTree::RestTree(const Memory &memory, const Array<RestBox> &boxes)
    : node_(HookAllocator<Node>(memory)),
      item_(boxes.size(), 0u, HookAllocator<uint32_t>(memory)),
      box_(boxes) {
  for (uint32_t i = 0; i < item_.size(); ++i) item_[i] = i;
  if (item_.empty()) return;
  node_.reserve(item_.size());
  build(0, static_cast<uint32_t>(item_.size()));
}

uint32_t RestTree::build(uint32_t begin, uint32_t end) {
  const auto center = [&](uint32_t i, int axis) { return 0.5 * box_[i].lo[axis] + 0.5 * box_[i].hi[axis]; };
  RestBox box = box_[item_[begin]], centers;
  for (int k = 0; k < 3; ++k) centers.lo[k] = centers.hi[k] = center(item_[begin], k);
  for (uint32_t i = begin; i < end; ++i)
    for (int k = 0; k < 3; ++k) {
      const RestBox &b = box_[item_[i]];
      const double c = center(item_[i], k);
      box.lo[k] = std::min(box.lo[k], b.lo[k]);
      box.hi[k] = std::max(box.hi[k], b.hi[k]);
      centers.lo[k] = std::min(centers.lo[k], c);
      centers.hi[k] = std::max(centers.hi[k], c);
    }
  const uint32_t number = static_cast<uint32_t>(node_.size());
  node_.push_back({box, begin, end, 0});
  if (end - begin <= kLeaf) return number;
  const Vec3 size = centers.hi - centers.lo;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
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
