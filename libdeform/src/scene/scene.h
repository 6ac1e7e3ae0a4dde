// A loaded scene: its world, built through the public API only, and what a runner needs beside it.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "scene/defs.h"

namespace dfm {
struct Body;
}

namespace dfm::scene {

struct ProbePoint {
  std::string name;
  dfm_body body = 0;
  uint32_t tet = 0;             // its number when the body was made
  std::vector<double> weights;  // of its corners, or of the nodes of the cell that it is a part of
};

class Scene {
 public:
  Scene(dfm_context *context, const std::string &path, const dfm_scene_options *options);
  ~Scene();
  Scene(const Scene &) = delete;
  Scene &operator=(const Scene &) = delete;

  dfm_context *context() const { return context_; }
  dfm_world world() const { return world_; }
  dfm_world release_world();  // the world outlives the scene
  const Definition &definition() const { return definition_; }
  size_t probe_count() const { return probes_.size(); }
  const ProbePoint &probe(size_t i) const { return probes_[i]; }
  // Which has the probe's cell, the body or a piece of it, and the points that its weights are of; null: none
  // has.
  dfm::Body *probe_body(size_t i, const uint32_t *&points) const;
  // NAN where none has.
  void probe_state(size_t i, double position[3], double velocity[3]) const;
  std::string value(const std::string &pointer) const;  // JSON text; throws where nothing is

 private:
  struct Tree;  // keeps the JSON library out of this header
  dfm_context *context_;
  dfm_world world_ = 0;
  Definition definition_;
  std::vector<ProbePoint> probes_;
  std::unique_ptr<Tree> tree_;
};

}  // namespace dfm::scene
