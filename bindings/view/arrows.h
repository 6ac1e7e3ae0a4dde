// Contact forces as arrows: one color where the contact sticks, another where it slides.
#pragma once
#include <vector>

#include "render/geometry.h"
#include "render/render.h"
#include "scene_file.h"

namespace view {

inline constexpr float kSticks[3] = {0.10f, 0.55f, 0.30f}, kSlides[3] = {0.95f, 0.62f, 0.05f};

// A shaft and two strokes for its head, which turn to the viewer; size: m, of what is shown.
void add_arrow(std::vector<double> &xyz, const render::Vec &foot, const render::Vec &tip,
               const render::Camera &camera, double size);

struct Touch {
  render::Vec point, force;  // m, N
  bool sticks;
};
// The contacts of the last sub-step; between two bodies, the force on the one that was made first.
std::vector<Touch> touches_of(const cli::SceneFile &scene);

class Arrows {
 public:
  // size: m, of what is shown; what they point to lives here until the next call.
  void fill(const std::vector<Touch> &touches, double size, const render::Camera &camera, render::Scene &out);
  double longest() const { return scale_; }  // N, of an arrow of full length

 private:
  std::vector<double> xyz_[2];
  double scale_ = 0;
};

}  // namespace view
