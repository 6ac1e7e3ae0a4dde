// Impulses and peak forces of all pairs over a run, for summary.json.
#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "scene_file.h"

namespace cli {

class Impulses {
 public:
  explicit Impulses(const SceneFile &scene) : scene_(scene) {}
  void add_step();
  std::string json() const;  // {"A/B": {"normal_Ns", "peak_N"}}

 private:
  struct Sum { double normal = 0, peak = 0; };  // N s, N
  const SceneFile &scene_;
  std::map<std::pair<uint64_t, uint64_t>, Sum> sums_;
  std::vector<dfm_pair_impulse> step_;
};

}  // namespace cli
