// Which way is up in the pictures of a scene: against its gravity, so that slopes made by tilting gravity
// look like slopes.
#pragma once
#include <array>
#include <vector>

#include "scene_file.h"

namespace cli {

class Upright {
 public:
  explicit Upright(const SceneFile &scene);
  // At a time of the world, s. Without gravity as soon after as there is some, or as long before, else z.
  void at(double t, double up[3]) const;
  bool tilts() const { return tilts_; }  // it changes during the scene

 private:
  struct Key {
    double t;
    std::array<double, 3> gravity;
  };
  std::vector<Key> keys_;
  bool tilts_ = false;
};

}  // namespace cli
