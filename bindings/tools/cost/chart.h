// Time against error as a picture: one drawing for the SVG in the page and for cost.png.
#pragma once
#include <string>

#include "canvas.h"
#include "study.h"

namespace cli::cost {

constexpr double kChartWidth = 1080, kChartHeight = 640;
void draw_chart(const Subject &subject, const Study &study, Canvas &canvas);

std::string svg_chart(const Subject &subject, const Study &study);
// cost.png by the renderer's own pens; false where this deform was built without it.
bool draw_file(const Subject &subject, const Study &study, const std::string &path);

}  // namespace cli::cost
