// Definition -> world, through the public C API only.
#pragma once
#include "scene/scene.h"

namespace dfm::scene {

// Owns the world until the scene takes it, so that a scene that fails halfway leaves nothing behind.
struct Built {
  dfm_world world = 0;
  std::vector<ProbePoint> probes;
};
Built build(dfm_context *context, Definition &def, uint64_t jitter_seed);

}  // namespace dfm::scene
