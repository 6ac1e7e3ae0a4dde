#include "canvas.h"

#include "messages.h"
#include "run_folder.h"

namespace view {
namespace {

bool on_processor(const std::string &device) {
  return device.find("llvmpipe") != std::string::npos || device.find("softpipe") != std::string::npos ||
         device.find("swrast") != std::string::npos;
}

}  // namespace

void Canvas::open(const Window &window, const std::string &detail) {
  window_ = &window;
  detail_ = detail;
  window.size(width_, height_);
}

void Canvas::make(render::Detail detail) {
  std::string why;
  renderer_ = render::WindowRenderer::create(window_->symbol_of(), detail, width_, height_, &why);
  if (!renderer_) throw cli::Failure(cli::kBadInput, "view: " + why);
}

bool Canvas::fit() {
  uint32_t width = 0, height = 0;
  window_->size(width, height);
  if (width == 0 || height == 0) return false;
  if (renderer_ && width == width_ && height == height_) return true;
  width_ = width;
  height_ = height;
  renderer_.reset();
  make(detail_ == "full" ? render::Detail::full : render::Detail::fast);
  if (detail_.empty() && !on_processor(renderer_->device())) make(render::Detail::full);
  return true;
}

void Canvas::show(const render::Scene &picture) {
  std::string why;
  if (!renderer_->show(picture, &why)) throw cli::Failure(cli::kBadInput, "view: " + why);
}

std::string Canvas::write(const std::string &folder, const std::string &name) {
  cli::make_folder(folder);
  const std::string path = name[0] == '/' ? name : folder + "/" + name;
  render::Image image;
  renderer_->read_window(image);
  std::string why;
  if (!render::write_png(path, image, &why)) throw cli::Failure(cli::kBadInput, why);
  return path;
}

}  // namespace view
