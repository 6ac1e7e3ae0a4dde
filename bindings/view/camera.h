// A camera that turns about what it looks at.
#pragma once
#include "render/geometry.h"

namespace view {

struct Ray { render::Vec origin, direction; };

class Orbit {
 public:
  void set(const render::Camera &camera);
  // The eye stays where it is, and the picture rolls.
  void set_up(const render::Vec &up);
  void turn(double across, double up);  // radians
  void shift(double right, double up);  // in heights of the picture
  void zoom(double factor);             // of the distance
  render::Camera camera() const;
  double distance() const { return distance_; }  // m, from the eye to what it looks at
  // From the eye through a point of the picture: x, y from -1 (left, bottom) to 1.
  Ray ray(double x, double y, double aspect) const;
  // Where the plane through `depth_of` that faces the camera is met by that ray.
  render::Vec at_depth(double x, double y, double aspect, const render::Vec &depth_of) const;

 private:
  render::Vec target_, up_{0, 0, 1}, x_{1, 0, 0};  // azimuths count from x_, which is square to up_
  double distance_ = 1, azimuth_ = 0, elevation_ = 0, fov_deg_ = 30;
};

}  // namespace view
