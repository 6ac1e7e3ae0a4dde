// Kinds of things (bodies, obstacles) that no rule of friction or contact tells apart: the same patterns
// match them, by name, group and material, and their zones have the same coefficients. Rules are then asked
// once for two kinds, and not for each pair: a body that shatters has hundreds of pieces, all of one or two
// kinds, and the tables of pairs are made again after each cut and each separation.
#pragma once
#include <vector>

#include "step/pair_table.h"

namespace dfm {

struct FilterRule;

class PairKinds {
 public:
  explicit PairKinds(const World &w);

  struct Pair {
    const FilterRule *filter;  // nullptr: no rule names the pair
    PairLaw law;               // of the first pair of these kinds that may touch; kept by the caller
  };
  // Things a (a body) and b: bodies by slot, then obstacles. Valid until the next call.
  Pair &of(uint32_t a, uint32_t b);

 private:
  const World &w_;
  std::vector<uint32_t> kind_;  // by thing
  uint32_t n_ = 0;              // of kinds
  std::vector<uint32_t> at_;    // [n_,n_] index into pairs_; kNone: not asked yet
  std::vector<Pair> pairs_;
};

}  // namespace dfm
