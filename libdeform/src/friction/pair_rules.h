// The friction rule of a pair. A side of a rule is a pattern; a side of a pair has a name, a group and a
// material.
//
//   pattern        matches                                   weight
//   body:GROUP     that group of that body's surface         4
//   body           that body or obstacle, or a piece of it   3
//   material=NAME  where it is of that material              2
//   *              everything                                1
//
// A rule matches a pair in either order; of those that match, the one with the largest sum of weights wins,
// then the last given.
#pragma once
#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace dfm {

// whole: name of the body of which this one is a piece; empty if it is not a piece.
struct PairSide { std::string_view name, group, material, whole = {}; };

inline constexpr std::string_view kMaterialPrefix = "material=";

// 0: no match.
inline int pattern_weight(std::string_view pattern, const PairSide &side) {
  if (pattern == "*") return 1;
  if (pattern.substr(0, kMaterialPrefix.size()) == kMaterialPrefix)
    return pattern.substr(kMaterialPrefix.size()) == side.material ? 2 : 0;
  if (pattern == side.name || (!side.whole.empty() && pattern == side.whole)) return 3;
  const auto group_of = [&](std::string_view name) {
    return pattern.size() == name.size() + 1 + side.group.size() && pattern[name.size()] == ':' &&
           pattern.substr(0, name.size()) == name && pattern.substr(name.size() + 1) == side.group;
  };
  const bool grouped =
      !side.group.empty() && (group_of(side.name) || (!side.whole.empty() && group_of(side.whole)));
  return grouped ? 4 : 0;
}

inline int rule_weight(const std::string between[2], const PairSide &a, const PairSide &b) {
  const auto both = [&](const PairSide &first, const PairSide &second) {
    const int i = pattern_weight(between[0], first), j = pattern_weight(between[1], second);
    return i && j ? i + j : 0;
  };
  return std::max(both(a, b), both(b, a));
}

// Whether both rules have the same two patterns, in either order: then the newer rule replaces the older one.
inline bool same_pair(const std::string a[2], const std::string b[2]) {
  return (a[0] == b[0] && a[1] == b[1]) || (a[0] == b[1] && a[1] == b[0]);
}

// Appends a rule and removes the one that it replaces. If the vector has no room for one more, this may throw
// before it changes anything.
template <class Rule>
void add_rule(std::vector<Rule> &rules, Rule &&fresh) {
  rules.reserve(rules.size() + 1);
  std::erase_if(rules, [&](const Rule &r) { return same_pair(r.between, fresh.between); });
  rules.push_back(std::forward<Rule>(fresh));
}

// Whether the pattern names the body or obstacle `name`, as a whole or by a group.
inline bool names(std::string_view pattern, std::string_view name) {
  return pattern == name || (pattern.size() > name.size() && pattern.substr(0, name.size()) == name &&
                             pattern[name.size()] == ':');
}

// Returns nullptr if no rule matches the pair.
template <class Rule>
const Rule *best_rule(const std::vector<Rule> &rules, const PairSide &a, const PairSide &b) {
  const Rule *best = nullptr;
  int most = 0;
  for (const Rule &r : rules) {
    const int weight = rule_weight(r.between, a, b);
    if (weight && weight >= most) {
      most = weight;
      best = &r;
    }
  }
  return best;
}

}  // namespace dfm
