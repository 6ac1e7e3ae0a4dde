// What the URL of a server has to say.
#pragma once
#include <cstdio>
#include <random>
#include <string>

namespace serve {

// 128 bits from the system.
inline std::string new_token() {
  std::random_device system;
  std::string out;
  for (int i = 0; i < 4; ++i) {
    char text[16];
    std::snprintf(text, sizeof text, "%08x", unsigned{system()});
    out += text;
  }
  return out;
}

}  // namespace serve
