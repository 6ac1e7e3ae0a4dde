// Where the features of a surface are after a cut.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "geometry/surface.h"

namespace dfm {

class SelfList;

// Numbers now by numbers before, the first of copies; kNone: gone.
struct FeatureMap {
  std::vector<uint32_t> of[3];  // surfels, edges, triangles
  FeatureMap() = default;
  FeatureMap(const Surface &before, const Surface &now);
};

// The surface before a cut, and where its features are now.
struct FormerSurface {
  uint64_t shape, now;  // numbers of both; the body has another one where the cut was taken back
  FeatureMap features;
  std::shared_ptr<const SelfList> list;  // of its pairs, made beside the steps; null: none
};

}  // namespace dfm
