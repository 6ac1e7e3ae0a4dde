// Lines, areas and words of charts and plots.
#pragma once
#include <string>

#ifdef DEFORM_HAVE_RENDER
#include "render/render.h"
#endif

namespace cli {

struct Ink { float r, g, b; };

// What they are drawn on; pixels, origin in the upper left.
class Canvas {
 public:
  virtual ~Canvas() = default;
  virtual void line(double x0, double y0, double x1, double y1, double width, Ink ink, bool dashed) = 0;
  virtual void disc(double x, double y, double radius, Ink ink, const std::string &tip) = 0;
  virtual void box(double x, double y, double width, double height, Ink ink) = 0;
  // size: height of a capital; anchor: 0 the left end of the base line at x, 0.5 its middle, 1 its right end
  virtual void text(double x, double y, double size, const std::string &words, Ink ink, double anchor) = 0;
};

#ifdef DEFORM_HAVE_RENDER
// An image, by how far the middle of each pixel is from the shape: soft edges without a graphics library.
class PixelCanvas : public Canvas {
 public:
  PixelCanvas(double width, double height);
  void line(double x0, double y0, double x1, double y1, double width, Ink ink, bool dashed) override;
  void disc(double x, double y, double radius, Ink ink, const std::string &tip) override;
  void box(double x, double y, double width, double height, Ink ink) override;
  void text(double x, double y, double size, const std::string &words, Ink ink, double anchor) override;
  void write(const std::string &path) const;  // PNG; throws Failure

 private:
  void stroke(double x0, double y0, double x1, double y1, double width, Ink ink);
  template <class Inside>
  void paint(double x0, double y0, double x1, double y1, Ink ink, Inside inside);
  render::Image image_;
};
#endif

}  // namespace cli
