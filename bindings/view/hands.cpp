#include "hands.h"

#include <algorithm>
#include <cmath>

namespace view {

using render::Vec;

namespace {

constexpr double kNear = 0.05, kLine = 0.3, kFar = 4;  // of the way to what the camera looks at
constexpr double kMin = 1e-3;                          // of a stroke, about radians

}  // namespace

void Hands::open(const Options &options, const std::string &title, bool hands) {
  window_ = Window::open(options.width, options.height, title, hands);
  canvas_.open(*window_, options.detail);
}

void Hands::run() {
  window_->begin_panels({}, 0.02);  // sizes of panels are known from the second time on
  panels();
  window_->end_panels();
  while (!window_->closed() && !quit_) frame();
}

void Hands::handle(const Input &in) {
  if (in.kind == Input::key) key(in.name);
  else mouse(in);
}

bool Hands::shared_key(const std::string &name) {
  if (name == "a") show_arrows_ = !show_arrows_;
  else if (name == "p") show_plots_ = !show_plots_;
  else if (name == "t") show_panels_ = !show_panels_;
  else if (name == "x") cutting_ = !cutting_;
  else if (name == "q" || name == "escape") quit_ = true;
  else return false;
  return true;
}

void Hands::mouse(const Input &in) {
  if (in.kind == Input::wheel) {
    if (!leads_deeper(in.turns) && !window_->panels_want_mouse()) orbit_.zoom(std::pow(0.88, in.turns));
    return;
  }
  const double dx = in.x - mouse_[0], dy = in.y - mouse_[1];
  mouse_[0] = in.x;
  mouse_[1] = in.y;
  if (in.kind == Input::press && held_ < 0 && !window_->panels_want_mouse()) {
    if (cutting_ && in.button == kLeft && steers()) stroke_ = ray();
    else press(in.button);
  }
  if (in.kind == Input::release) {
    release(in.button);
    if (in.button == held_) held_ = -1;
    if (in.button == kLeft && stroke_) {
      const Ray begin = *stroke_, end = ray();
      stroke_.reset();
      const double away = orbit_.distance();
      const auto at = [&](const Ray &r, double part) { return r.origin + r.direction * (part * away); };
      const Vec corners[4] = {at(begin, kNear), at(begin, kFar), at(end, kFar), at(end, kNear)};
      double blade[12];
      for (int i = 0; i < 4; ++i) {
        blade[3 * i] = corners[i].x;
        blade[3 * i + 1] = corners[i].y;
        blade[3 * i + 2] = corners[i].z;
      }
      if (render::norm(begin.direction - end.direction) > kMin) cut(blade);
    }
  }
  if (in.kind != Input::move || held_ < 0 || leads(dx, dy)) return;
  if (held_ == kMiddle) orbit_.shift(-dx / canvas_.height(), dy / canvas_.height());
  else orbit_.turn(-kTurn * dx / canvas_.height(), kTurn * dy / canvas_.height());
}

void Hands::add_stroke(render::Scene &picture) {
  if (!stroke_) return;
  const Ray now = ray();
  const double away = kLine * orbit_.distance();
  const Vec from = stroke_->origin + stroke_->direction * away, to = now.origin + now.direction * away;
  const double ends[6] = {from.x, from.y, from.z, to.x, to.y, to.z};
  std::copy_n(ends, 6, stroked_);
  picture.lines.push_back({stroked_, 1, {0.8f, 0.1f, 0.1f}, 3, true});
}

}  // namespace view
