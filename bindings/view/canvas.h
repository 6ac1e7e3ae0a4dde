// Pictures in a window: the renderer that fits its size.
#pragma once
#include <memory>
#include <string>

#include "render/render.h"
#include "window.h"

namespace view {

class Canvas {
 public:
  void open(const Window &window, const std::string &detail);  // "full", "fast"; "": by what GL runs on
  bool fit();  // as large as the window is now; false: it has no size. Throws cli::Failure
  void show(const render::Scene &picture);
  // The picture as PNG, into the folder where `name` is relative; returns its path.
  std::string write(const std::string &folder, const std::string &name);
  uint32_t width() const { return width_; }  // pixels
  uint32_t height() const { return height_; }
  double aspect() const { return double(width_) / height_; }
  // Where a pixel is, from -1 (left, bottom) to 1.
  double across(double x) const { return 2 * x / width_ - 1; }
  double above(double y) const { return 1 - 2 * y / height_; }

 private:
  void make(render::Detail detail);

  const Window *window_ = nullptr;
  std::string detail_;
  std::unique_ptr<render::WindowRenderer> renderer_;
  uint32_t width_ = 0, height_ = 0;
};

}  // namespace view
