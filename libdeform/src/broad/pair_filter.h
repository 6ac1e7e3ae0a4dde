// Which pairs may touch: category masks, and rules for named pairs, which take precedence.
#pragma once
#include <algorithm>
#include <cstdint>

#include "core/memory.h"
#include "geometry/views.h"

namespace dfm {

struct PairRule {
  uint64_t a, b;  // ids; of two bodies a < b; of a body and an obstacle a is the body
  bool obstacle;
  bool touch;
};

struct PairFilter {
  Array<PairRule> rules;  // sorted by (a, obstacle, b); changed through set()
  uint64_t version = 0;   // increases with every change, so that lists built with older rules are rebuilt

  PairFilter() = default;
  explicit PairFilter(const Memory &memory) : rules(memory) {}

  void set(uint64_t a, uint64_t b, bool obstacle, bool touch) {
    if (!obstacle && b < a) std::swap(a, b);
    const PairRule rule{a, b, obstacle, touch};
    const auto at = std::lower_bound(rules.begin(), rules.end(), rule, before);
    if (at != rules.end() && !before(rule, *at)) *at = rule;
    else rules.insert(at, rule);
    ++version;
  }
  bool may_touch(const BodyView &a, const BodyView &b) const {
    if (a.id == b.id) return false;  // self contact is an effect of its own
    return decide(std::min(a.id, b.id), std::max(a.id, b.id), false,
                  masks(a.category, a.collides_with, b.category, b.collides_with));
  }
  bool may_touch(const BodyView &a, const ObstacleView &b) const {
    return decide(a.id, b.id, true, masks(a.category, a.collides_with, b.category, b.collides_with));
  }

 private:
  static bool masks(uint32_t category_a, uint32_t with_a, uint32_t category_b, uint32_t with_b) {
    return (category_a & with_b) != 0 && (category_b & with_a) != 0;
  }
  static bool before(const PairRule &l, const PairRule &r) {
    return l.a != r.a ? l.a < r.a : l.obstacle != r.obstacle ? l.obstacle < r.obstacle : l.b < r.b;
  }
  bool decide(uint64_t a, uint64_t b, bool obstacle, bool otherwise) const {
    const PairRule rule{a, b, obstacle, false};
    const auto at = std::lower_bound(rules.begin(), rules.end(), rule, before);
    return at != rules.end() && !before(rule, *at) ? at->touch : otherwise;
  }
};

}  // namespace dfm
