#include "body/feature_map.h"

#include <algorithm>
#include <utility>

namespace dfm {

FeatureMap::FeatureMap(const Surface &before, const Surface &now) {
  const uint32_t counts[3] = {before.nsurfel, before.nedge, before.ntri};
  for (size_t kind = 0; kind < 3; ++kind) {
    std::vector<std::pair<uint32_t, uint32_t>> by_name;
    for (uint32_t i = 0; i < now.name[kind].size(); ++i) by_name.push_back({now.name[kind][i], i});
    std::sort(by_name.begin(), by_name.end());
    for (uint32_t i = 0; i < counts[kind]; ++i) {
      const uint32_t name = before.name[kind].empty() ? i : before.name[kind][i];
      const auto at = std::lower_bound(by_name.begin(), by_name.end(), std::pair(name, 0u));
      of[kind].push_back(at != by_name.end() && at->first == name ? at->second : kNone);
    }
  }
}

}  // namespace dfm
