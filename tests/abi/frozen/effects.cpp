// Scenes one after another, a few steps each, for effects.py: what callgrind has counted in dfm_world_step
// when frozen_mark() returns is of the scene before. Prints the state's hash of each.
//
//   frozen_effects PLUGIN_DIR STEP STEPS SCENE...
#include <cstdio>
#include <cstdlib>

#include "deform/deform.h"

extern "C" __attribute__((noinline)) void frozen_mark(uint64_t hash) {
  std::printf("%016llx\n", static_cast<unsigned long long>(hash));
}

namespace {

void need(dfm_status status, const char *what) {
  if (status == DFM_OK) return;
  std::fprintf(stderr, "%s: %s\n", what, dfm_last_error());
  std::exit(1);
}

}  // namespace

int main(int count, char **words) {
  if (count < 5) return 2;
  dfm_context_def def = dfm_context_def_default();
  def.plugin_dir = words[1];
  def.threads = 1;
  def.log = [](void *, int32_t, const char *) {};
  dfm_context *context = nullptr;
  need(dfm_context_create(&def, &context), "context");
  const double step = std::atof(words[2]);
  const int steps = std::atoi(words[3]);
  for (int i = 4; i < count; ++i) {
    dfm_world world = 0;
    need(dfm_scene_load(context, words[i], &world), words[i]);
    for (int k = 0; k < steps; ++k) need(dfm_world_step(world, step, nullptr), words[i]);
    frozen_mark(dfm_world_hash(world));
    need(dfm_world_destroy(world), words[i]);
  }
  dfm_context_destroy(context);
}
