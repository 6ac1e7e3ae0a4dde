// A window on a run elsewhere: draws what `--stream rtp://` sends with a camera of its own, and asks the
// sender for what hands do, where it lets them.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "arrows.h"
#include "camera.h"
#include "canvas.h"
#include "cli.h"
#include "live/rtp_receiver.h"
#include "options.h"
#include "script.h"
#include "window.h"

namespace view {

class Remote {
 public:
  // options.scene: "rtp://ADDRESS:PORT[?token=TEXT]".
  Remote(const Options &options, const cli::Globals &globals);
  // Until the window is closed, or the script is at its end. A script has the clock's time, and begins with
  // the first frame that comes.
  void run();

 private:
  void frame();
  void handle(const Input &input);
  void key(const std::string &name);
  void mouse(const Input &input);
  void press(int button);
  void pull_to_mouse();
  void set_slider(const std::string &name, double value);
  void ask(const char *what, const std::function<void(cli::JsonObject &)> &more = {},
           const std::string &replaces = "");
  bool steers() const;  // the sender takes what this window asks for
  bool running() const { return receiver_.state().get("running") == "true"; }
  void first_look();
  void panels();
  void fill(render::Scene &picture);
  void draw();
  void shot(const std::string &name);

  const Options &options_;
  const cli::Globals &globals_;
  std::optional<Script> script_;
  live::RtpReceiver receiver_;
  std::unique_ptr<Window> window_;
  Canvas canvas_;
  Orbit orbit_;
  Arrows arrows_;
  std::map<uint32_t, std::vector<double>> placed_;  // points of things that have triangles
  double size_ = 0;                                 // m, of what is shown; 0: nothing has come yet
  bool set_ = false;                                // the camera is as the sender's scene says
  double began_ = 0, last_ = 0;                     // s
  double mouse_[2] = {0, 0};
  int held_ = -1;                      // the button that turns or shifts the camera; -1: none
  std::optional<render::Vec> pulled_;  // m, the place that the mouse holds
  bool quit_ = false, show_arrows_ = true, show_panels_ = true;
};

}  // namespace view
