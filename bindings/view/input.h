// What hands and scripts do, in pixels from the upper left corner of the picture.
#pragma once
#include <string>

namespace view {

enum Button { kLeft = 0, kRight = 1, kMiddle = 2 };

struct Input {
  enum Kind { move, press, release, wheel, key } kind = move;
  double x = 0, y = 0;  // of the mouse
  int button = kLeft;
  double turns = 0;  // of the wheel, away from the user
  std::string name;  // of the key, as the help lists it
};

}  // namespace view
