// Time against error as a picture: one drawing for the SVG in the page and for cost.png.
#pragma once
#include <string>

#include "study.h"

namespace cli::cost {

struct Ink { float r, g, b; };

// What a chart is drawn on; pixels, origin in the upper left.
class Canvas {
 public:
  virtual ~Canvas() = default;
  virtual void line(double x0, double y0, double x1, double y1, double width, Ink ink, bool dashed) = 0;
  virtual void disc(double x, double y, double radius, Ink ink, const std::string &tip) = 0;
  virtual void box(double x, double y, double width, double height, Ink ink) = 0;
  // size: height of a capital; anchor: 0 the left end of the base line at x, 0.5 its middle, 1 its right end
  virtual void text(double x, double y, double size, const std::string &words, Ink ink, double anchor) = 0;
};

constexpr double kChartWidth = 1080, kChartHeight = 640;
void draw_chart(const Subject &subject, const Study &study, Canvas &canvas);

std::string svg_chart(const Subject &subject, const Study &study);
// cost.png by the renderer's own pens; false where this deform was built without it.
bool draw_file(const Subject &subject, const Study &study, const std::string &path);

}  // namespace cli::cost
