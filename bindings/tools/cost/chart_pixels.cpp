#include "chart.h"

namespace cli::cost {

#ifdef DEFORM_HAVE_RENDER
bool draw_file(const Subject &subject, const Study &study, const std::string &path) {
  PixelCanvas pixels(kChartWidth, kChartHeight);
  draw_chart(subject, study, pixels);
  pixels.write(path);
  return true;
}
#else
bool draw_file(const Subject &, const Study &, const std::string &) { return false; }
#endif

}  // namespace cli::cost
