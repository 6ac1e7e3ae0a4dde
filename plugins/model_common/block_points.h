// The points of one block of a body for kernels: its own points, then points of other blocks that its cells
// or springs use (halo). Plain data only.
#pragma once
#include <stdint.h>

namespace model {

struct BlockPoints {
  uint32_t owned, local;
  const uint32_t *point;  // [local + ahead] number of the point in the host's arrays
  double *p;  // [local,8] x y z 0 vx vy vz 0: a point with its velocity is one cache line; owned by the pass
  double *f;  // [local,4]
  // A point's place in the host's arrays is prefetched this many points ahead. Points of a block lie in short
  // runs there, which the processor does not predict. 0: no prefetch, since the body fits into the cache.
  uint32_t ahead;
};

// Slots in the f of all blocks: a halo point of another block, and the corresponding own point.
struct Merge { uint32_t from, to; };

}  // namespace model
