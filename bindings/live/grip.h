// Tools in the user's hand: which one, where it shall go, what it feels.
#pragma once
#include <string>
#include <vector>

#include "render/geometry.h"
#include "live/simulation.h"

namespace live {

// On a tool in the last step, world axes, the torque about its origin; N, N m.
struct Felt { render::Vec at, force, torque; };

class Grip {
 public:
  // size: m, of what is shown; a tool is led over twice that in a second at most.
  Grip(Simulation &simulation, double size);
  size_t count() const { return tools_.size(); }
  const std::string &name(size_t tool) const { return tools_[tool].name; }
  Felt felt(size_t tool) const;
  // The number of the tool whose part has that name; -1: none has.
  int tool_of(const std::string &part) const;

  bool holds() const { return taken_ >= 0; }
  int taken() const { return taken_; }
  void take(int tool);  // the one before stays where it is; -1: none
  void next();          // the next one, and after the last none
  void let_go();        // it returns to the motion that the scene has for it
  // Whether the tool that is taken has jaws.
  bool jaws() const { return tools_[size_t(taken_)].jaws; }
  double opening() const { return opening_; }  // rad, where it shall go
  render::Vec to() const { return to_; }       // m
  dfm_pose pose() const;                       // the same with its rotation
  void move_to(const render::Vec &to);
  void turn(const render::Vec &axis, double angle);  // about an axis through its origin, world frame
  void open(double by);                              // rad
  void put(const dfm_pose &pose, double opening);
  void forget() { taken_ = -1; }  // the world was put into another state

 private:
  struct Entry {
    dfm_tool tool = 0;
    std::string name;
    bool jaws = false;
  };
  void update_pull();

  Simulation &simulation_;
  double speed_;
  std::vector<Entry> tools_;
  int taken_ = -1;
  render::Vec to_;
  double rotation_[4] = {0, 0, 0, 1}, opening_ = 0;
};

// JSON text of "tools" of the scene with one more: a ball on a spring and a damper, above all bodies. Throws
// cli::Failure where there is no body to touch.
std::string tools_with_probe(const cli::SceneFile &scene, const render::Bounds &bodies);

}  // namespace live
