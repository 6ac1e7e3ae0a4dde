// What a hand does to a world between two steps, as one line of JSON each: the viewer does it and records
// it, `deform replay` does it again.
//
//   {"do": "pull", "body": B, "points": [..], "weights": [..], "to": [x,y,z], "stiffness": k, "damping": c}
//   {"do": "move", "to": [x,y,z]}     the end of that spring
//   {"do": "release"}                 the spring goes
//   {"do": "gravity", "to": [x,y,z]}
//   {"do": "friction", "between": [A,B], "key": "mu", "value": v}
//   {"do": "param", "body": B, "key": "young", "value": v}
//   {"do": "step", "length": h}       of the steps that follow, s
#pragma once
#include <string>

#include "json_text.h"
#include "scene_file.h"

namespace cli {

class ByHand {
 public:
  explicit ByHand(const SceneFile &scene) : scene_(scene) {}
  // Throws Failure with the library's sentence; nothing has changed then.
  void act(const JsonValue &line);
  bool pulls() const { return body_ != 0; }
  dfm_body pulled() const { return body_; }
  // With which the spring pulls now, N.
  void force(double out[3]) const;
  double step() const { return step_; }  // s; 0: none was told
  // The world was put into another state: the spring is gone with the old one.
  void forget() { body_ = 0; }

 private:
  void pull(const JsonValue &line);
  const BodyView &body(const JsonValue &line) const;

  const SceneFile &scene_;
  dfm_body body_ = 0;
  uint32_t spring_ = 0;
  double step_ = 0;
};

}  // namespace cli
