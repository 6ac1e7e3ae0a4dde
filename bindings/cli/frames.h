// Pictures of a run through the off-screen renderer; without one (not built, or no backend here) a warning
// and no pictures.
#pragma once
#include <memory>
#include <string>

#include "scene_file.h"

namespace cli {

class Frames {
 public:
  // Null where pictures cannot be made; the reason goes to the warnings.
  static std::unique_ptr<Frames> create(const SceneFile &scene, const std::string &folder);
  virtual ~Frames() = default;
  virtual void draw(double t) = 0;
  // After the last one: draws those once more whose colors are of a smaller range of values than the whole
  // run has, so that a color means the same in all of them.
  virtual void finish() = 0;
  virtual std::string drawn_by() const = 0;  // as OpenGL names it, e.g. "llvmpipe (LLVM 15.0.6, 256 bits)"
};

}  // namespace cli
