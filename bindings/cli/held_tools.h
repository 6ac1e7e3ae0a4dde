// Tools that a hand leads (by_hand.h). They follow the hand at a bounded speed, so that no jump of a mouse
// becomes a step that the library refuses; let go, they return to their keys in the same way.
#pragma once
#include <string>
#include <vector>

#include "json_text.h"
#include "scene_file.h"

namespace cli {

// A rotation (x, y, z, w) turned further by a rotation vector in the world frame.
void turned(const double from[4], const double turn[3], double out[4]);

class HeldTools {
 public:
  explicit HeldTools(const SceneFile &scene) : scene_(scene) {}
  // {"do": "tool", ..}, {"do": "let", ..}. Throw Failure; nothing has changed then.
  void lead(const JsonValue &line);
  void let(const JsonValue &line);
  void before_step(double h);
  void forget() { held_.clear(); }
  // What a user must do to continue from the present state.
  std::vector<JsonValue> lines() const;

 private:
  struct Held {
    dfm_tool tool = 0;
    std::string name;
    dfm_pose to = {};
    double opening = 0, speed = 0;  // rad, m/s
    bool jaws = false, returns = false;
    JsonValue line;
  };
  Held &held(const std::string &name);
  static bool walk(Held &held, double now, double h);

  const SceneFile &scene_;
  std::vector<Held> held_;
};

}  // namespace cli
