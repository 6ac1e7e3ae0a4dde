// A viewer without hands: lines `t key|drag|slider|shot ARGS`, t in seconds of the frame clock. Empty lines
// and what follows # are skipped.
//
//   0.5 key space                       presses a key
//   1.0 drag 640 360 700 300 0.5 0.2    moves the mouse with the left button down, from one pixel to another,
//                                       in 0.5 s (0.5 by default), and holds it there for 0.2 s (0)
//   1.0 drag right 640 360 700 300      the same with the right or the middle button
//   2.0 slider mu:*:* 0.3               sets a slider by its name
//   2.5 shot a.png                      writes the picture of that frame, after all other actions of it
#pragma once
#include <string>
#include <vector>

#include "input.h"

namespace view {

struct ScriptLine {
  double t = 0;  // s
  enum Kind { key, drag, slider, shot } kind = key;
  std::string name;                         // of a key, a slider, a file
  double value = 0;                         // of a slider
  double from[2] = {0, 0}, to[2] = {0, 0};  // pixels
  double seconds = 0.5, hold = 0;           // of a drag
  int button = kLeft;
  size_t line = 0;  // in the file, from 1
};

class Script {
 public:
  // Throws cli::Failure: file, line, what was expected.
  explicit Script(const std::string &path);
  // Inputs of the frame that ends at t, and the sliders and shots of this frame.
  void frame(double t, std::vector<Input> &inputs, std::vector<ScriptLine> &current);
  bool done() const { return next_ == lines_.size() && drags_.empty(); }
  const std::string &path() const { return path_; }

 private:
  std::string path_;
  std::vector<ScriptLine> lines_, drags_;  // in order of time; drags_: those under way
  size_t next_ = 0;
};

}  // namespace view
