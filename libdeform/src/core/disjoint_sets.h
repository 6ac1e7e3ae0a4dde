// Disjoint sets of the numbers 0..n-1 (union-find). The root of a set is its lowest number whatever the order
// of joins, so numbering needs no sort.
#pragma once
#include <algorithm>
#include <cstdint>
#include <numeric>

#include "core/memory.h"

namespace dfm {

struct DisjointSets {
  Array<uint32_t> of;  // [n] a member nearer to the root; after number(): the number of the set

  explicit DisjointSets(const Memory &memory, uint32_t n = 0) : of{memory} { start(n); }
  void start(uint32_t n) {
    of.resize(n);
    std::iota(of.begin(), of.end(), 0u);
  }
  uint32_t root(uint32_t i) {
    while (of[i] != i) i = of[i] = of[of[i]];
    return i;
  }
  // False: both are of one set already.
  bool join(uint32_t a, uint32_t b) {
    a = root(a);
    b = root(b);
    of[std::max(a, b)] = std::min(a, b);
    return a != b;
  }
  // Sets are numbered in the order of their roots. Returns how many there are.
  uint32_t number() {
    uint32_t n = 0;
    for (uint32_t i = 0; i < of.size(); ++i) of[i] = of[i] == i ? n++ : of[of[i]];
    return n;
  }
};

}  // namespace dfm
