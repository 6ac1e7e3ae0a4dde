// A surface as it is at rest, for judging whether two parts of it that are near have come near, or
// have always been.
#pragma once
#include "core/memory.h"
#include "math/vec3.h"

namespace dfm {

struct SelfRest {
  Array<double> x;  // [nsurfel,4] m, N times the phyxels at rest, in the mesh's frame
  // m: parts that are nearer than this through the material are the two sides of one layer of cells or two
  double thin = 0;
  Vec3 at(uint32_t surfel) const { return load3(&x[4 * size_t{surfel}]); }
};

// of d_c: what is nearer at rest lies on itself there, and has no side
inline constexpr double kClosedAtRest = 1e-2;

// Two features of one surface: surfel and triangle that does not have it, or two edges without a common end,
// the lower one first.
struct SelfPair { uint32_t a, b; };

}  // namespace dfm
