// The world behind the window: steps as `deform run` takes them, and back to its start.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "recording.h"

namespace live {

class Simulation {
 public:
  // start: when the scene began, s. The state that the world has now is the one that restart() goes back to.
  Simulation(const cli::SceneFile &scene, double start);
  // One step. False: none was taken, at_end() or trouble() says why.
  bool step();
  void restart();
  // A state of `deform run --save`, of this viewer or of a recording, as `deform run` has them. Throw
  // cli::Failure; a pull ends.
  void load(const std::string &path);
  void save(const std::string &path);
  // What by_hand.h lists; recorded where a recording runs. Throws cli::Failure.
  void act(const cli::JsonObject &line);
  const cli::ByHand &hand() const { return hand_; }
  void release();  // what the hand pulls
  void start_recording(const cli::RunOptions &options);
  // How many states it has.
  uint32_t stop_recording();
  bool recording() const { return recorder_.has_value(); }
  double time() const;  // s, since the scene's start
  bool at_end() const;  // the scene's duration has passed, and go_on() was not called
  void go_on() { beyond_ = true; }
  // Why the last step failed; empty: it did not.
  const std::string &trouble() const { return trouble_; }
  double step_ms() const { return step_ms_; }  // of the last steps, smoothed
  const cli::SceneFile &scene() const { return scene_; }

 private:
  void was_set();
  double interval() const;  // s, between recorded states

  const cli::SceneFile &scene_;
  dfm_world world_;
  cli::ByHand hand_;
  std::optional<cli::Recorder> recorder_;
  double recorded_step_ = 0, recorded_at_ = 0, next_record_ = 0;  // s
  double start_;                                                  // s, of the scene
  bool beyond_ = false;
  std::string first_;  // snapshot
  std::string trouble_;
  double step_ms_ = 0;
};

}  // namespace live
