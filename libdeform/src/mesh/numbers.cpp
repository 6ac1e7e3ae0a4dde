#include "mesh/numbers.h"

#include <algorithm>

namespace dfm {

void Numbers::finish(const Cursor &in) {
  if (tags_.size() >= UINT32_MAX)
    in.unsupported("%zu %ss; up to %u are read", tags_.size(), of_, UINT32_MAX - 1);
  if (!std::is_sorted(tags_.begin(), tags_.end())) {
    order_.resize(tags_.size());
    for (uint32_t i = 0; i < order_.size(); ++i) order_[i] = i;
    std::sort(order_.begin(), order_.end(),
              [&](uint32_t a, uint32_t b) { return tags_[a] != tags_[b] ? tags_[a] < tags_[b] : a < b; });
    std::sort(tags_.begin(), tags_.end());
  }
  const auto twice = std::adjacent_find(tags_.begin(), tags_.end());
  if (twice != tags_.end()) in.refuse("%s number %lld is given twice", of_, ll(*twice));
}

uint32_t Numbers::find(const Cursor &in, int64_t tag) const {
  size_t at;
  if (!tags_.empty() && tag >= tags_.front() && tag <= tags_.back()) {
    at = size_t(uint64_t(tag) - uint64_t(tags_.front()));  // where numbers have no gaps, this is the place
    if (at >= tags_.size() || tags_[at] != tag)
      at = size_t(std::lower_bound(tags_.begin(), tags_.end(), tag) - tags_.begin());
    if (tags_[at] == tag) return order_.empty() ? uint32_t(at) : order_[at];
  }
  in.refuse("%s %lld is used, which the file does not define", of_, ll(tag));
}

void Numbers::find_range(int64_t first, int64_t last, int64_t step, Array<uint32_t> &out) const {
  const auto from = std::lower_bound(tags_.begin(), tags_.end(), first);
  for (auto tag = from; tag != tags_.end() && *tag <= last; ++tag)
    if ((uint64_t(*tag) - uint64_t(first)) % uint64_t(step) == 0)
      out.push_back(order_.empty() ? uint32_t(tag - tags_.begin()) : order_[size_t(tag - tags_.begin())]);
}

}  // namespace dfm
