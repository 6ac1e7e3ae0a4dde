// What every window has: a picture, a camera that the mouse leads, keys, and a stroke that cuts.
#pragma once
#include <memory>
#include <optional>
#include <string>

#include "camera.h"
#include "canvas.h"
#include "input.h"
#include "options.h"
#include "render/geometry.h"
#include "window.h"

namespace view {

inline constexpr double kTurn = 3.5;  // radians for a way across the picture's height

class Hands {
 public:
  virtual ~Hands() = default;
  // Until the window is closed, or the script is at its end.
  void run();

 protected:
  void open(const Options &options, const std::string &title, bool hands);
  void handle(const Input &input);
  bool shared_key(const std::string &name);  // false: not every window has it
  double aspect() const { return canvas_.aspect(); }
  double across() const { return canvas_.across(mouse_[0]); }
  double above() const { return canvas_.above(mouse_[1]); }
  Ray ray() const { return orbit_.ray(across(), above(), aspect()); }
  void add_stroke(render::Scene &picture);

  virtual void frame() = 0;
  virtual void panels() = 0;
  virtual void key(const std::string &name) = 0;
  virtual void press(int button) = 0;  // on the picture; held_ is it where it leads the camera
  virtual void release(int button) = 0;
  virtual void cut(const double blade[12]) = 0;  // m, corners
  virtual bool steers() const { return true; }   // false: what it asks for is not taken
  // Pixels, turns; false: the camera takes them.
  virtual bool leads(double, double) { return false; }
  virtual bool leads_deeper(double) { return false; }

  std::unique_ptr<Window> window_;
  Canvas canvas_;
  Orbit orbit_;
  double mouse_[2] = {0, 0};
  int held_ = -1;  // the button that leads the camera; -1: none
  bool quit_ = false, show_arrows_ = true, show_panels_ = true, show_plots_ = true, cutting_ = false;

 private:
  void mouse(const Input &input);

  std::optional<Ray> stroke_;  // where it has begun
  double stroked_[6] = {};     // m, of its line in the picture
};

}  // namespace view
