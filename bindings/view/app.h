// The viewer: inputs in, steps, pictures with panels out.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "camera.h"
#include "cli.h"
#include "drawing.h"
#include "options.h"
#include "script.h"
#include "simulation.h"
#include "window.h"

namespace view {

class App {
 public:
  App(const Options &options, const cli::Globals &globals);
  // Until the window is closed, or the script is at its end.
  void run();

 private:
  void frame();
  void handle(const Input &input);
  void key(const std::string &name);
  void mouse(const Input &input);
  void set_slider(const std::string &name, double value);
  void advance(double seconds);
  void restart();
  bool draw();  // false: the window has no size
  void panels();
  void controls();
  void numbers();
  void shot(const std::string &name);
  double aspect() const { return double(width_) / height_; }
  // The mouse, from -1 (left, bottom) to 1.
  double across() const { return 2 * mouse_[0] / width_ - 1; }
  double above() const { return 1 - 2 * mouse_[1] / height_; }

  Options options_;
  cli::Globals globals_;
  std::optional<Script> script_;
  cli::SceneFile scene_;
  Simulation simulation_;
  std::unique_ptr<Window> window_;
  std::unique_ptr<render::WindowRenderer> renderer_;
  std::string device_;  // what GL calls itself
  cli::Drawing drawing_;
  Orbit orbit_;
  render::Bounds extent_;
  uint32_t width_ = 0, height_ = 0;  // pixels
  bool running_ = false, quit_ = false, help_ = false;
  double speed_ = 1;                // simulated seconds per second
  double wanted_ = 0;               // s of the scene, where the clock of the window stands
  double last_ = 0;                 // s, when the last frame began
  double frame_ms_ = 0, real_ = 0;  // smoothed; simulated seconds per second
  uint64_t frames_ = 0;
  double mouse_[2] = {0, 0};
  int held_ = -1;        // the button that turns or shifts the camera; -1: none
  std::string message_;  // for the user, until the next one
};

}  // namespace view
