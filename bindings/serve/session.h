// A scene that runs for viewers elsewhere: takes what they ask for, steps, and shows the result.
#pragma once
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/packets.h"
#include "cli/rtp.h"
#include "cli/upright.h"
#include "live/pull.h"
#include "live/sliders.h"
#include "server.h"

namespace serve {

struct Options {
  std::string scene, token, stream;  // stream: "rtp://ADDRESS:PORT"; empty: by WebSocket alone
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
  void hear_stream();
  void show_stream();
  cli::JsonObject state() const;  // without sliders and probes
  std::string whole_state() const;
  Bytes packets(uint32_t kind, dfm_body body = 0);

  const Options &options_;
  cli::SceneFile scene_;
  live::Simulation simulation_;
  live::Pull pull_;
  std::vector<live::Slider> sliders_;
  cli::Upright upright_;
  Server server_;
  std::optional<cli::RtpSender> stream_;
  uint32_t at_stream_ = 0;  // number of the viewer there; 0: none steers
  size_t told_ = 0;         // the slider of which it is told next
  cli::Shapes shown_;       // bodies that viewers have
  Bytes buffer_;
  bool running_, scene_due_ = true;
  double wanted_ = 0, real_ = 0;  // s; simulated seconds per second, smoothed
  uint32_t frame_ = 0, holder_ = 0;
  std::string message_;
};

}  // namespace serve
