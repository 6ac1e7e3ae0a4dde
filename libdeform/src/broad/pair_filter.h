// Which pairs may touch: category masks, and rules for named pairs, which take precedence. Pairs that are set
// aside do not, whatever the rules say, which hold again afterwards.
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
  Array<PairRule> aside;  // as rules, where touch is whether the pair is back; changed through set_aside()
  uint64_t version = 0;   // increases with every change, so that lists built with older rules are rebuilt

  PairFilter() = default;
  explicit PairFilter(const Memory &memory) : rules(memory), aside(memory) {}

  void set(uint64_t a, uint64_t b, bool obstacle, bool touch) { put(rules, a, b, obstacle, touch); }
  void set_aside(uint64_t a, uint64_t b, bool obstacle, bool off) { put(aside, a, b, obstacle, !off); }
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
  void put(Array<PairRule> &list, uint64_t a, uint64_t b, bool obstacle, bool touch) {
    if (!obstacle && b < a) std::swap(a, b);
    const PairRule rule{a, b, obstacle, touch};
    const auto at = std::lower_bound(list.begin(), list.end(), rule, before);
    if (at != list.end() && !before(rule, *at)) *at = rule;
    else list.insert(at, rule);
    ++version;
  }
  static bool look_up(const Array<PairRule> &list, const PairRule &rule, bool otherwise) {
    const auto at = std::lower_bound(list.begin(), list.end(), rule, before);
    return at != list.end() && !before(rule, *at) ? at->touch : otherwise;
  }
  bool decide(uint64_t a, uint64_t b, bool obstacle, bool otherwise) const {
    const PairRule rule{a, b, obstacle, false};
    return look_up(aside, rule, true) && look_up(rules, rule, otherwise);
  }
};

}  // namespace dfm
