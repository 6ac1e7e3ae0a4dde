// Impulses and peak forces of all pairs over a run, for summary.json.
//
// The force in one sub-step depends on its length. So the peak is the largest mean over a window that moves
// over the run: by the integrators of a scene, whatever their sub-steps, it is the same window.
#pragma once
#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "scene_file.h"

namespace cli {

// The largest impulse in a window of fixed length, of impulses that follow each other in time.
class LargestInWindow {
 public:
  explicit LargestInWindow(double window) : window_(window) {}
  // Evenly from `from` to `to`, s.
  void add(double from, double to, double impulse);
  double value() const;  // N s

 private:
  struct Piece { double from, to, impulse; };
  double within(double from, double to) const;
  double window_;
  double most_ = 0;
  std::deque<Piece> pieces_;  // what a window may still hold
};

class Impulses {
 public:
  // window: s
  Impulses(const SceneFile &scene, double window) : scene_(scene), window_(window) {}
  void add_step(double step);  // s, its length; the world is at its end
  std::string json() const;    // {"A/B": {"normal_Ns", "peak_N", "peak_window_s"}}

 private:
  struct Sum {
    double normal = 0;  // N s
    LargestInWindow largest;
  };
  const SceneFile &scene_;
  double window_;
  std::map<std::pair<uint64_t, uint64_t>, Sum> sums_;
};

// s: 5 ms, or the longest step that the scene allows, if that is longer.
double peak_window(const SceneFile &scene);

}  // namespace cli
