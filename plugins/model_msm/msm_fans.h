// The cells of a block as fans around common edges, for the kernels in single precision. A fan of n cells has
// n + 3 points where n cells by themselves have 4 n: fetching points and adding to them is what costs.
#pragma once
#include "msm_body.h"

namespace msm {

// Cell k has the points a, b, ring[k], ring[k + 1], which are local, in the orientation of its list. A fan
// without cells holds springs alone.
struct Fan {
  uint32_t cells, a, b;
  uint32_t ring[kMaxInFan + 1], slot[kMaxInFan];  // slot: place in the body's block order
  uint32_t springs;                               // bit 0: a b, bit 1 + k: a ring[k]
};

// All of a body. Every cell and every spring is in one.
struct Fans {
  Buffer<Fan> all;         // block after block, neighbors close to each other
  Buffer<uint32_t> begin;  // [nblock + 1]
  explicit Fans(const Body &body);

  // use(fans, how many, cells of the longest) for the groups of kFans of block n.
  template <class Use>
  void each_group(uint32_t n, const Use &use) const {
    for (uint32_t k = begin[n]; k < begin[n + 1]; k += kFans) {
      const uint32_t count = std::min(kFans, begin[n + 1] - k);
      uint32_t cells = 0;
      for (uint32_t lane = 0; lane < count; ++lane) cells = std::max(cells, all[k + lane].cells);
      use(all.data() + k, count, cells);
    }
  }

 private:
  Buffer<uint8_t> placed_;  // [nedge]
  void place_springs(const Body &body);
  void add_rest(const Body &body);
};

}  // namespace msm
