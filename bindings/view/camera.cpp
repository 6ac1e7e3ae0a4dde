#include "camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace view {

using render::Vec;

void Orbit::set(const render::Camera &camera) {
  target_ = render::vec(camera.look_at);
  const Vec back = render::vec(camera.eye) - target_;
  distance_ = std::max(render::norm(back), 1e-9);
  azimuth_ = std::atan2(render::dot(back, render::cross(up_, x_)), render::dot(back, x_));
  elevation_ = std::asin(std::clamp(render::dot(back, up_) / distance_, -1.0, 1.0));
  fov_deg_ = camera.fov_deg;
}

void Orbit::set_up(const Vec &up) {
  if (render::norm(up - up_) == 0) return;
  const render::Camera now = camera();
  up_ = up;
  x_ = render::unit(x_ - up * render::dot(x_, up), render::square_to(up));
  set(now);
}

void Orbit::turn(double across, double up) {
  azimuth_ += across;
  elevation_ = std::clamp(elevation_ + up, -1.55, 1.55);  // never over the pole, where up has no meaning
}

void Orbit::shift(double right, double up) {
  const render::View v = render::view_of(camera());
  const double high = 2 * v.tan_half * distance_;
  target_ = target_ + v.right * (right * high) + v.up * (up * high);
}

void Orbit::zoom(double factor) { distance_ = std::max(distance_ * factor, 1e-9); }

render::Camera Orbit::camera() const {
  const Vec level = x_ * std::cos(azimuth_) + render::cross(up_, x_) * std::sin(azimuth_);
  const Vec back = level * std::cos(elevation_) + up_ * std::sin(elevation_);
  const Vec eye = target_ + back * distance_;
  render::Camera c = {{eye.x, eye.y, eye.z}, {target_.x, target_.y, target_.z}, {up_.x, up_.y, up_.z}};
  c.fov_deg = fov_deg_;
  return c;
}

Ray Orbit::ray(double x, double y, double aspect) const {
  const render::View v = render::view_of(camera());
  const Vec d = v.right * (x * v.tan_half * aspect) + v.up * (y * v.tan_half) - v.back;
  return {v.eye, render::unit(d)};
}

Vec Orbit::at_depth(double x, double y, double aspect, const Vec &depth_of) const {
  const render::View v = render::view_of(camera());
  const Ray r = ray(x, y, aspect);
  const double depth = render::dot(v.eye - depth_of, v.back), along = -render::dot(r.direction, v.back);
  return r.origin + r.direction * (depth / std::max(along, 1e-9));
}

}  // namespace view
