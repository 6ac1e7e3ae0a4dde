// What `deform run --plot` draws: energy, bodies, contacts and probes over time, from the recorded states.
#pragma once
#include <memory>
#include <string>

#include "scene_file.h"

namespace cli {

class RunPlots {
 public:
  // Null where pictures cannot be made; the reason goes to the warnings.
  static std::unique_ptr<RunPlots> create(const SceneFile &scene);
  virtual ~RunPlots() = default;
  virtual void record() = 0;
  // Throws Failure where it cannot be written.
  virtual void write(const std::string &path) const = 0;
};

}  // namespace cli
