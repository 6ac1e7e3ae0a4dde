#ifdef DEFORM_HAVE_RENDER
#include "canvas.h"

#include <algorithm>
#include <cmath>

#include "messages.h"
#include "plane.h"

namespace cli {
namespace {

constexpr double kZoom = 1.5;

}  // namespace

PixelCanvas::PixelCanvas(double width, double height) {
  image_.width = uint32_t(kZoom * width);
  image_.height = uint32_t(kZoom * height);
  image_.rgb.assign(size_t(image_.width) * image_.height * 3, 255);
}

void PixelCanvas::write(const std::string &path) const {
  std::string why;
  if (!render::write_png(path, image_, &why)) throw Failure(kBadInput, why);
}

// inside: how far a point lies within the shape, negative outside
template <class Inside>
void PixelCanvas::paint(double x0, double y0, double x1, double y1, Ink ink, Inside inside) {
  const auto clamped = [](double x, uint32_t most) { return int(std::clamp(x, 0.0, double(most))); };
  const int left = clamped(kZoom * x0 - 1, image_.width), right = clamped(kZoom * x1 + 2, image_.width);
  const int top = clamped(kZoom * y0 - 1, image_.height), bottom = clamped(kZoom * y1 + 2, image_.height);
  const float rgb[3] = {ink.r, ink.g, ink.b};
  for (int py = top; py < bottom; ++py)
    for (int px = left; px < right; ++px) {
      const double depth = kZoom * inside((px + 0.5) / kZoom, (py + 0.5) / kZoom);
      const float cover = float(std::clamp(depth + 0.5, 0.0, 1.0));
      uint8_t *const at = &image_.rgb[3 * (size_t(py) * image_.width + size_t(px))];
      for (int k = 0; k < 3 && cover > 0; ++k)
        at[k] = uint8_t(std::lround(float(at[k]) + cover * (255 * rgb[k] - float(at[k]))));
    }
}

void PixelCanvas::line(double x0, double y0, double x1, double y1, double width, Ink ink, bool dashed) {
  const double length = plane_length(x1 - x0, y1 - y0), dash = 6, gap = 5;
  if (!dashed) return stroke(x0, y0, x1, y1, width, ink);
  for (double s = 0; s < length; s += dash + gap) {
    const double a = s / length, b = std::min(s + dash, length) / length;
    stroke(x0 + a * (x1 - x0), y0 + a * (y1 - y0), x0 + b * (x1 - x0), y0 + b * (y1 - y0), width, ink);
  }
}

void PixelCanvas::disc(double x, double y, double radius, Ink ink, const std::string &) {
  paint(x - radius, y - radius, x + radius, y + radius, ink,
        [&](double px, double py) { return radius - plane_length(px - x, py - y); });
}

void PixelCanvas::box(double x, double y, double width, double height, Ink ink) {
  paint(x, y, x + width, y + height, ink,
        [&](double px, double py) { return std::min({px - x, x + width - px, py - y, y + height - py}); });
}

void PixelCanvas::text(double x, double y, double size, const std::string &words, Ink ink, double anchor) {
  const double height = kZoom * size, wide = render::text_width(height, words);
  render::draw_text(image_, kZoom * x - anchor * wide, kZoom * y, height, words, {ink.r, ink.g, ink.b});
}

void PixelCanvas::stroke(double x0, double y0, double x1, double y1, double width, Ink ink) {
  const double dx = x1 - x0, dy = y1 - y0, l2 = std::max(dx * dx + dy * dy, 1e-12), r = width / 2;
  paint(std::min(x0, x1) - r, std::min(y0, y1) - r, std::max(x0, x1) + r, std::max(y0, y1) + r, ink,
        [&](double px, double py) {
          const double s = std::clamp(((px - x0) * dx + (py - y0) * dy) / l2, 0.0, 1.0);
          return r - plane_length(px - x0 - s * dx, py - y0 - s * dy);
        });
}

}  // namespace cli
#endif
