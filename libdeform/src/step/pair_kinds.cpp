#include "step/pair_kinds.h"

#include <bit>
#include <map>

#include "friction/pair_rules.h"
#include "state/obstacle.h"
#include "state/world.h"

namespace dfm {
namespace {

// As whole things, and by zone. Text that a side refers to lives in the world.
PairSide side_of(const World &w, uint32_t thing) {
  const size_t nb = w.bodies.size();
  if (thing >= nb) return {w.obstacles[thing - nb]->name, {}, w.obstacles[thing - nb]->material};
  const Body &b = *w.bodies[thing];
  return {b.name, {}, b.material, b.whole_name};
}

// What each pattern of the rules weighs at this side.
template <class Rule>
void weigh(const std::vector<Rule> &rules, const PairSide &side, std::vector<uint64_t> &key) {
  for (const Rule &r : rules)
    for (const std::string &pattern : r.between) key.push_back(uint64_t(pattern_weight(pattern, side)));
}

std::vector<uint64_t> key_of(const World &w, uint32_t thing) {
  std::vector<uint64_t> key;
  const PairSide side = side_of(w, thing);
  weigh(w.filters, side, key);
  const auto add = [&](const SurfaceZones::Zone &zone) {
    key.push_back(std::bit_cast<uint64_t>(zone.friction));
    weigh(w.friction, {side.name, zone.group, zone.material, side.whole}, key);
  };
  const size_t nb = w.bodies.size();
  if (thing < nb)
    for (const SurfaceZones::Zone &zone : w.bodies[thing]->zones.list) add(zone);
  else add(w.obstacles[thing - nb]->zone);
  return key;
}

}  // namespace

PairKinds::PairKinds(const World &w) : w_(w) {
  std::map<std::vector<uint64_t>, uint32_t> known;
  for (uint32_t thing = 0; thing < w.bodies.size() + w.obstacles.size(); ++thing) {
    const auto [at, fresh] = known.try_emplace(key_of(w, thing), n_);
    n_ += fresh;
    kind_.push_back(at->second);
  }
  at_.assign(size_t{n_} * n_, kNone);
}

PairKinds::Pair &PairKinds::of(uint32_t a, uint32_t b) {
  uint32_t &at = at_[size_t{kind_[a]} * n_ + kind_[b]];
  if (at == kNone) {
    at = uint32_t(pairs_.size());
    pairs_.push_back({best_rule(w_.filters, side_of(w_, a), side_of(w_, b)), {}});
  }
  return pairs_[at];
}

}  // namespace dfm
