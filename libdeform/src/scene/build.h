// Definition -> world, through the public C API only.
#pragma once
#include "scene/load.h"
#include "scene/scene.h"

namespace dfm::scene {

// Owns the world until the scene takes it, so that a scene that fails halfway leaves nothing behind.
struct Built {
  dfm_world world = 0;
  std::vector<ProbePoint> probes;
};
Built build(dfm_context *context, Definition &def, MeshFiles &files, uint64_t jitter_seed);
// A body with this model, its cuts and the tools that cut it, in a world without other things.
Built build_alone(dfm_context *context, const Definition &def, const Body &body, const std::string &model,
                  Params params);

}  // namespace dfm::scene
