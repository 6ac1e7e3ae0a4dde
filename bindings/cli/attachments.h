// Forces of attachments, for attachments.csv: what a clamp or a spring exerts on a body. Nothing of it in a
// scene without attachments.
#pragma once
#include <array>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "output.h"
#include "scene_file.h"

namespace cli {

class Attachments {
 public:
  Attachments(const SceneFile &scene, const std::string &folder);
  // A row for each attachment that holds now.
  void record();

 private:
  void write(double t, const BodyView &body, uint32_t number);

  const SceneFile &scene_;
  const bool static_;
  std::unique_ptr<Csv> table_;
  double last_time_;
  std::map<std::pair<uint64_t, uint32_t>, std::array<double, 3>> last_impulse_;  // N s at the last record
};

}  // namespace cli
