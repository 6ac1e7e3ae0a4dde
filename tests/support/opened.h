// A scene that a test opens. Where it is refused there is a status and no world.
#pragma once
#include "support.h"
#include "world.h"

namespace test {

struct Opened {
  Context context;
  dfm_scene scene = 0;
  dfm_world world = 0;
  dfm_status status;
  explicit Opened(const std::string &path, uint64_t jitter = 0) {
    dfm_scene_options options{};
    options.size = sizeof options;
    options.jitter_seed = jitter;
    status = dfm_scene_open(context, path.c_str(), &options, &scene);
    if (scene) ok(dfm_scene_world(scene, &world));
  }
  ~Opened() {
    if (scene) dfm_scene_close(scene);
  }
  Opened(const Opened &) = delete;
  Opened &operator=(const Opened &) = delete;
};

// The path, for Opened.
inline std::string written(const std::string &path, const std::string &text) {
  write_file(path, text);
  return path;
}

}  // namespace test
