// A scene that runs for viewers elsewhere: takes what they ask for, steps, and shows the result.
#pragma once
#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "cli/packets.h"
#include "cli/upright.h"
#include "live/pull.h"
#include "live/sliders.h"
#include "live/viewers.h"

namespace live {

class Session {
 public:
  // set: as `deform run --set` takes them.
  Session(const cli::Globals &globals, const std::string &scene, const std::vector<std::string> &set,
          Viewers &viewers, bool runs);
  // Does what viewers have asked for, takes steps for as long as a picture lasts, s, and shows the result.
  void picture(double seconds);
  const cli::SceneFile &scene() const { return scene_; }
  // The state as it goes to a viewer of that number, with one slider and one probe, which go by turns.
  std::string brief_state(uint32_t viewer, size_t turn) const;

 private:
  using Clock = std::chrono::steady_clock;
  void act(const Request &request);
  void handle(const std::string &what, const cli::JsonValue &line, uint32_t viewer);
  void attempt(const std::function<void()> &what);
  void let_go();
  void advance(double seconds);
  void show();
  // Without sliders and probes. most: bytes of each text.
  cli::JsonObject state(size_t most = std::string::npos) const;
  std::string whole_state() const;
  std::string probe(uint32_t i, size_t most = std::string::npos) const;

  cli::SceneFile scene_;
  Simulation simulation_;
  Pull pull_;
  std::vector<Slider> sliders_;
  cli::Upright upright_;
  Viewers &viewers_;
  cli::Teller teller_;
  bool running_;
  double wanted_ = 0, real_ = 0;  // s; simulated seconds per second, smoothed
  uint32_t holder_ = 0;
  std::string message_;
};

}  // namespace live
