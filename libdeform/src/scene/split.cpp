#include "scene/split.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace dfm::scene {
namespace {

constexpr uint32_t kNone = UINT32_MAX;

class Splitter {
 public:
  Splitter(double longest, Triangles &s) : longest2_(longest * longest), s_(s) {}

  // One round over all triangles; false: nothing was to be split.
  bool round() {
    middle_.clear();
    triangles_.clear();
    group_.clear();
    bool any = false;
    for (size_t t = 0; 3 * t < s_.triangles.size(); ++t) any = split(t) || any;
    if (!any) return false;
    s_.triangles.swap(triangles_);
    s_.group.swap(group_);
    return true;
  }

 private:
  double longest2_;
  Triangles &s_;
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> middle_;  // of the edges split in this round
  std::vector<uint32_t> triangles_, group_;

  double length2(uint32_t a, uint32_t b) const {
    double sum = 0;
    for (size_t k = 0; k < 3; ++k) sum += std::pow(s_.points[3 * a + k] - s_.points[3 * b + k], 2);
    return sum;
  }

  uint32_t middle(uint32_t a, uint32_t b) {
    if (!(length2(a, b) > longest2_)) return kNone;
    const auto [at, added] = middle_.try_emplace(std::pair(std::min(a, b), std::max(a, b)),
                                                 static_cast<uint32_t>(s_.points.size() / 3));
    if (added)
      for (size_t k = 0; k < 3; ++k)
        s_.points.push_back(0.5 * s_.points[3 * a + k] + 0.5 * s_.points[3 * b + k]);
    return at->second;
  }

  void add(size_t t, std::initializer_list<std::array<uint32_t, 3>> parts) {
    for (const auto &part : parts) {
      triangles_.insert(triangles_.end(), part.begin(), part.end());
      if (!s_.group.empty()) group_.push_back(s_.group[t]);
    }
  }

  bool split(size_t t) {
    uint32_t c[3], m[3];
    for (size_t k = 0; k < 3; ++k) c[k] = s_.triangles[3 * t + k];
    int count = 0;
    for (size_t k = 0; k < 3; ++k) {
      m[k] = middle(c[k], c[(k + 1) % 3]);
      count += m[k] != kNone;
    }
    if (count == 0) add(t, {{c[0], c[1], c[2]}});
    if (count == 3) add(t, {{c[0], m[0], m[2]}, {m[0], c[1], m[1]}, {m[2], m[1], c[2]}, {m[0], m[1], m[2]}});
    // turned so that edge 0 is the one that is split alone, or the one that is not
    for (size_t k = 0; k < 3 && (count == 1 || count == 2); ++k) {
      if ((m[k] != kNone) != (count == 1)) continue;
      const uint32_t a = c[k], b = c[(k + 1) % 3], top = c[(k + 2) % 3];
      const uint32_t right = m[(k + 1) % 3], left = m[(k + 2) % 3];
      if (count == 1) {
        add(t, {{a, m[k], top}, {m[k], b, top}});
      } else if (length2(a, right) <= length2(b, left)) {
        add(t, {{left, right, top}, {a, b, right}, {a, right, left}});
      } else {
        add(t, {{left, right, top}, {a, b, left}, {b, right, left}});
      }
      break;
    }
    return count > 0;
  }
};

}  // namespace

void split_long_edges(double longest, Triangles &surface) {
  Splitter splitter(longest, surface);
  while (splitter.round()) {}
}

}  // namespace dfm::scene
