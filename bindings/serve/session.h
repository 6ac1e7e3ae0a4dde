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
#include "server.h"

namespace serve {

struct Options {
  std::string scene, token;
  std::vector<std::string> set;
  uint16_t port = 0;    // 0: a free one
  double rate = 30;     // pictures a second
  bool paused = false;  // begins so
  double seconds = 0;   // of the clock, after which it ends; 0: never
};

class Session {
 public:
  Session(const Options &options, const cli::Globals &globals);
  // Until a signal ends it.
  void run();

 private:
  using Clock = std::chrono::steady_clock;
  void act(const Request &request);
  void ask(const std::string &what, const cli::JsonValue &line, uint32_t viewer);
  void attempt(const std::function<void()> &what);
  void let_go();
  void advance(double seconds);
  void show();
  void show_scene(cli::Shapes shapes);
  std::string state() const;
  Bytes packets(uint32_t kind, dfm_body body = 0);

  const Options &options_;
  cli::SceneFile scene_;
  live::Simulation simulation_;
  live::Pull pull_;
  std::vector<live::Slider> sliders_;
  cli::Upright upright_;
  Server server_;
  cli::Shapes shown_;  // bodies that viewers have
  Bytes buffer_;
  bool running_, scene_due_ = true;
  double wanted_ = 0, real_ = 0;  // s; simulated seconds per second, smoothed
  uint32_t frame_ = 0, holder_ = 0;
  std::string message_;
};

}  // namespace serve
