// Where the features of a surface are after a cut.
#pragma once
#include <cstdint>
#include <vector>

#include "geometry/surface.h"

namespace dfm {

// Numbers now by numbers before, the first of copies; kNone: gone.
struct FeatureMap {
  std::vector<uint32_t> of[3];  // surfels, edges, triangles
  FeatureMap() = default;
  FeatureMap(const Surface &before, const Surface &now);
};

// The surface before a cut, and where its features are now.
struct FormerSurface {
  uint64_t shape;
  FeatureMap features;
};

}  // namespace dfm
