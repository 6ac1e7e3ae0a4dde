// What has come into sensors and left them, for sensors.csv and summary.json. Nothing of it in a scene
// without sensors.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "output.h"
#include "scene_file.h"

namespace cli {

class Sensors {
 public:
  Sensors(const SceneFile &scene, const std::string &folder);
  void add_step();
  // {SENSOR: {"begins", "ends", "inside": [THING]}}; empty without sensors
  std::string json() const;

 private:
  struct Seen {
    uint64_t sensor;
    uint64_t begins = 0, ends = 0;
  };
  const SceneFile &scene_;
  std::vector<Seen> seen_;
  std::unique_ptr<Csv> table_;
};

}  // namespace cli
