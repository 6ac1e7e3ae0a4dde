// The world behind the window: steps as `deform run` takes them, and back to its start.
#pragma once
#include <string>
#include <vector>

#include "scene_file.h"

namespace view {

class Simulation {
 public:
  // start: when the scene began, s. The state that the world has now is the one that restart() goes back to.
  Simulation(const cli::SceneFile &scene, double start);
  // One step. False: none was taken, at_end() or trouble() says why.
  bool step();
  void restart();
  // The world was put into another state.
  void was_set();
  double time() const;  // s, since the scene's start
  bool at_end() const;  // the scene's duration has passed, and go_on() was not called
  void go_on() { beyond_ = true; }
  // Why the last step failed; empty: it did not.
  const std::string &trouble() const { return trouble_; }
  double step_ms() const { return step_ms_; }  // of the last steps, smoothed
  const cli::SceneFile &scene() const { return scene_; }

 private:
  const cli::SceneFile &scene_;
  dfm_world world_;
  double start_;  // s, of the scene
  bool beyond_ = false;
  std::vector<char> first_;  // snapshot
  std::string trouble_;
  double step_ms_ = 0;
};

}  // namespace view
