// Islands: sets of things that touch each other, directly or through others. Sleep, and other decisions for
// groups of touching bodies, depend on all members of an island and on nothing outside. Built on demand.
#pragma once
#include "core/disjoint_sets.h"
#include "core/lists.h"

namespace dfm {

// Things are numbers 0..n-1 (body slots, then other kinds if needed). Call start(), join() any pairs,
// finish(); then the columns are valid, and `of` has the island of each thing. Order is that of the lowest
// number in each island, whatever the order of the pairs.
struct Islands : DisjointSets {
  uint32_t count = 0;
  Array<uint32_t> begin, member;  // [count+1], [n] things by island, ascending

  explicit Islands(const Memory &memory) : DisjointSets(memory) { use_memory(memory, begin, member); }
  void reserve(uint32_t n) {  // start() with as many allocates nothing
    of.reserve(n);
    begin.reserve(size_t{n} + 1);
    member.reserve(n);
  }
  void finish() {
    count = number();
    list_by(count, of.size(), [&](uint32_t i) { return of[i]; }, begin, member);
  }
};

}  // namespace dfm
