// Where tools are and what they and the hands behind them feel, for tools.csv. Nothing of it in a scene
// without tools.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "output.h"
#include "scene_file.h"

namespace cli {

class Tools {
 public:
  Tools(const SceneFile &scene, const std::string &folder);
  void add_step(double dt);
  void record();  // a row for each

 private:
  struct Felt {
    dfm_tool tool;
    std::string name;
    double impulse[12] = {};  // N s and N m s since the last row: of the tool, of the hand
  };
  const SceneFile &scene_;
  std::vector<Felt> tools_;
  double span_ = 0;  // s since the last row
  std::unique_ptr<Csv> table_;
};

}  // namespace cli
