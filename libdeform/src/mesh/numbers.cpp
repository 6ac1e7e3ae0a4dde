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
  const size_t at = place(tag);
  if (at == tags_.size()) in.refuse("%s %lld is used, which the file does not define", of_, ll(tag));
  return position(at);
}

size_t Numbers::place(int64_t tag) const {
  if (tags_.empty() || tag < tags_.front() || tag > tags_.back()) return tags_.size();
  // where numbers have no gaps, this is the place
  size_t at = size_t(uint64_t(tag) - uint64_t(tags_.front()));
  if (at >= tags_.size() || tags_[at] != tag)
    at = size_t(std::lower_bound(tags_.begin(), tags_.end(), tag) - tags_.begin());
  return tags_[at] == tag ? at : tags_.size();
}

uint64_t Numbers::find_range(int64_t first, int64_t last, int64_t step, Array<uint32_t> &out) const {
  if (last < first) return 0;
  const size_t from = size_t(std::lower_bound(tags_.begin(), tags_.end(), first) - tags_.begin()),
               to = size_t(std::upper_bound(tags_.begin(), tags_.end(), last) - tags_.begin());
  const uint64_t steps = (uint64_t(last) - uint64_t(first)) / uint64_t(step);
  if (steps >= to - from) {
    for (size_t at = from; at < to; ++at)
      if ((uint64_t(tags_[at]) - uint64_t(first)) % uint64_t(step) == 0) out.push_back(position(at));
    return to - from;
  }
  for (uint64_t k = 0; k <= steps; ++k) {
    const size_t at = place(int64_t(uint64_t(first) + k * uint64_t(step)));
    if (at < tags_.size()) out.push_back(position(at));
  }
  return steps + 1;
}

}  // namespace dfm
