// What a hand does to a world between two steps, as one line of JSON each: the viewer does it and records
// it, `deform replay` does it again.
//
//   {"do": "pull", "body": B, "points": [..], "weights": [..], "to": [x,y,z], "stiffness": k, "damping": c}
//   {"do": "drag", "body": B, "corners": [..], "weights": [..], "to": [x,y,z], "stiffness": k, "damping": c}
//                                     by impulses before each step, where the body's model takes no spring;
//                                     corners: surfels of the picked triangle
//   {"do": "drag", "rigid": R, "place": [x,y,z], "to": .., "stiffness": k, "damping": c}
//                                     the same of a rigid body; place: m, in the axes of its pose
//   {"do": "move", "to": [x,y,z]}     the end of that spring
//   {"do": "release"}                 the spring goes
//   {"do": "cut", "blade": [12 numbers]}
//                                     opens faces of all bodies that can be cut and that a blade meets on its
//                                     way, as DFM_CUT_BLADE with DFM_CUT_SPLIT; m
//   {"do": "gravity", "to": [x,y,z]}
//   {"do": "friction", "between": [A,B], "key": "mu", "value": v}
//   {"do": "param", "body": B, "key": "young", "value": v}
//   {"do": "tool", "tool": T, "to": [x,y,z], "rotation": [x,y,z,w], "opening": rad, "speed": v}
//                                     a tool follows the hand to there, at v m/s at most
//   {"do": "let", "tool": T, "speed": v}
//                                     it returns to its keys, or stands still where it has none
//   {"do": "step", "length": h}       of the steps that follow, s
#pragma once
#include <string>
#include <vector>

#include "held_tools.h"
#include "json_text.h"
#include "scene_file.h"

namespace cli {

class ByHand {
 public:
  explicit ByHand(const SceneFile &scene) : scene_(scene), tools_(scene) {}
  // Throws Failure with the library's sentence; nothing has changed then.
  void act(const JsonValue &line);
  // Before each step, of h s: what is dragged gets its impulse, and tools go on.
  void before_step(double h);
  bool pulls() const { return body_ != 0 || drag_.thing != 0; }
  // With which the spring pulls now, or what was dragged was pulled in the last step; N.
  void force(double out[3]) const;
  double step() const { return step_; }  // s; 0: none was given
  // Acts by which tools are led now: those of a recording that begins here.
  std::vector<JsonValue> tool_lines() const { return tools_.lines(); }
  // The world was put into another state: the spring is gone with the old one, and tools are led no more.
  void forget() {
    tools_.forget();
    body_ = 0;
    drag_.thing = 0;
  }

 private:
  struct Drag {
    uint64_t thing = 0;  // a body, or a rigid body; 0: nothing is dragged
    bool rigid = false;
    std::vector<double> place;  // of a rigid body, [3] m in its own axes
    std::vector<uint32_t> corners;
    std::vector<double> weights;
    std::vector<double> to;  // [3] m
    double stiffness = 0, damping = 0, mass = 0;
    double force[3] = {0, 0, 0};
  };

  void pull(const JsonValue &line);
  void drag(const JsonValue &line);
  void cut(const JsonValue &line) const;
  bool at(double place[3], double velocity[3]) const;  // of what is dragged, now; false: it is gone
  const BodyView &body(const JsonValue &line) const;

  const SceneFile &scene_;
  dfm_body body_ = 0;
  uint32_t spring_ = 0;
  Drag drag_;
  HeldTools tools_;
  double step_ = 0;
};

}  // namespace cli
