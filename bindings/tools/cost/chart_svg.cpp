#include "chart.h"
#include "messages.h"

namespace cli::cost {
namespace {

class Svg : public Canvas {
 public:
  void line(double x0, double y0, double x1, double y1, double width, Ink ink, bool dashed) override {
    out_ += "<path d=\"M" + at(x0, y0) + "L" + at(x1, y1) + "\" stroke=\"" + color(ink) +
            "\" stroke-width=\"" + number(width) + "\"" + (dashed ? " stroke-dasharray=\"6 5\"" : "") +
            "/>\n";
  }
  void disc(double x, double y, double radius, Ink ink, const std::string &tip) override {
    out_ += "<circle cx=\"" + number(x) + "\" cy=\"" + number(y) + "\" r=\"" + number(radius) + "\" fill=\"" +
            color(ink) + "\"" + (tip.empty() ? "/>\n" : "><title>" + escaped(tip) + "</title></circle>\n");
  }
  void box(double x, double y, double width, double height, Ink ink) override {
    out_ += "<rect x=\"" + number(x) + "\" y=\"" + number(y) + "\" width=\"" + number(width) +
            "\" height=\"" + number(height) + "\" fill=\"" + color(ink) + "\"/>\n";
  }
  void text(double x, double y, double size, const std::string &words, Ink ink, double anchor) override {
    const char *const anchors[] = {"start", "middle", "end"};
    out_ += "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" font-size=\"" + number(1.4 * size) +
            "\" text-anchor=\"" + anchors[int(2 * anchor)] + "\" fill=\"" + color(ink) + "\">" +
            escaped(words) + "</text>\n";
  }
  std::string whole() const {
    return "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + number(kChartWidth) + " " +
           number(kChartHeight) + "\" font-family=\"system-ui, sans-serif\" role=\"img\">\n" + out_ +
           "</svg>\n";
  }

 private:
  static std::string number(double x) { return formatted("%.1f", x); }
  static std::string at(double x, double y) { return number(x) + " " + number(y); }
  static std::string color(Ink ink) {
    return formatted("#%02x%02x%02x", unsigned(255 * ink.r + 0.5f), unsigned(255 * ink.g + 0.5f),
                     unsigned(255 * ink.b + 0.5f));
  }
  std::string out_;
};

}  // namespace

std::string svg_chart(const Subject &subject, const Study &study) {
  Svg svg;
  draw_chart(subject, study, svg);
  return svg.whole();
}

}  // namespace cli::cost
