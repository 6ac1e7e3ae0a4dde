// The options of `deform view`.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace view {

struct Options {
  std::string scene;   // its file; empty with `replay`: the recording's
  std::string replay;  // a folder of `deform run --record`; empty: none
  std::string script;  // empty: hands
  std::string from;    // a state to begin with; empty: the scene's start
  std::string out;     // folder for pictures, states and recordings
  std::string detail;  // "full", "fast"; empty: by what GL runs on
  std::vector<std::string> set;
  uint32_t width = 1280, height = 720;  // pixels
};

}  // namespace view
