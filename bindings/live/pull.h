// A body held by the mouse: a spring from the points around the picked place to where the mouse is. It is a
// load like any other, inside the step: what is pulled still collides, sticks and slides. A rigid body, or
// one whose model takes no spring, gets the impulse of such a spring before each step.
#pragma once
#include <string>

#include "render/geometry.h"
#include "live/grip.h"
#include "live/simulation.h"

namespace live {

std::string text_of(const render::Vec &v);  // as JSON

class Pull {
 public:
  explicit Pull(Simulation &simulation) : simulation_(simulation) {}
  // Takes hold of what the ray meets first. False: nothing that can be pulled.
  bool grab(const render::Vec &origin, const render::Vec &direction);
  // The tool that the ray meets first; -1: it meets something else first, or nothing.
  int tool_at(const Grip &grip, const render::Vec &origin, const render::Vec &direction) const;
  void move(const render::Vec &to);  // m, where the mouse is
  void release() { simulation_.release(); }
  bool holds() const { return simulation_.hand().pulls(); }
  render::Vec place() const;                     // m, of the picked place of the surface, now
  const render::Vec &to() const { return to_; }  // m
  double force() const;                          // N
  // Times a spring that swings the whole body four times a second.
  double stiffness = 1;

 private:
  bool grab_rigid(const std::string &name);
  bool drag(cli::JsonObject &line, double mass);

  Simulation &simulation_;
  dfm_body body_ = 0;
  dfm_rigid rigid_ = 0;  // 0: it is a body that is held
  double arm_[3] = {0, 0, 0};
  uint32_t corners_[3] = {0, 0, 0};  // surfels of the picked triangle
  double weights_[3] = {0, 0, 0};
  render::Vec to_, offset_;  // offset: from the picked place to the mean of the points that the spring holds
};

}  // namespace live
