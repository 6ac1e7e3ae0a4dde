// Any bytes as a scene file: an error with a sentence, or a world that takes a step.
#include "deform/deform.h"
#include "fuzz_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  dfm_context *const context = fuzz::context();
  const fuzz::File file(data, size);
  dfm_world world = 0;
  const dfm_status status = dfm_scene_load(context, file.path(), &world);
  if (status == DFM_OK) {
    dfm_world_step(world, 1e-6, nullptr);
    dfm_world_destroy(world);
  } else if (dfm_last_error()[0] == 0) std::abort();
  return 0;
}
