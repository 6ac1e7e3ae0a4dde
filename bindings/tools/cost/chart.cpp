#include "chart.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "messages.h"
#include "report.h"

namespace cli::cost {
namespace {

constexpr Ink kPaper{1, 1, 1}, kText{0.13f, 0.15f, 0.18f}, kFaint{0.86f, 0.87f, 0.89f},
    kGray{0.45f, 0.48f, 0.52f}, kBand{0.94f, 0.945f, 0.955f}, kTarget{0.80f, 0.25f, 0.20f},
    kFront{0.25f, 0.28f, 0.33f};
// The renderer's palette, so that pictures and chart agree.
constexpr Ink kInks[] = {{0.243f, 0.510f, 0.796f}, {0.890f, 0.365f, 0.286f}, {0.180f, 0.631f, 0.557f},
                         {0.957f, 0.706f, 0.243f}, {0.557f, 0.431f, 0.757f}, {0.510f, 0.690f, 0.310f},
                         {0.886f, 0.494f, 0.643f}, {0.388f, 0.471f, 0.573f}, {0.690f, 0.498f, 0.361f},
                         {0.376f, 0.741f, 0.847f}};
// Errors above it say that a choice is wrong, not how wrong; to scale, one such point, as of a scene that
// rests and then slides, would leave the others a line. The scene as it is and the front are always on scale.
constexpr double kWrong = 10;
constexpr double kLeft = 86, kRight = 372, kTop = 58, kBottom = 66;  // margins

// A logarithmic axis over whole and half decades.
struct Scale {
  double lo, hi, from, to;  // decades; pixels
  double at(double x) const {
    return from + (std::clamp(std::log10(x), lo, hi) - lo) / (hi - lo) * (to - from);
  }
};

Scale scale_of(std::vector<double> values, double from, double to) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double x) { return !(x > 0); }), values.end());
  if (values.empty()) values = {0.1, 1};
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  double lo = std::floor(2 * std::log10(*least) - 0.2) / 2, hi = std::ceil(2 * std::log10(*most) + 0.2) / 2;
  return {lo, std::max(hi, lo + 1), from, to};
}

std::string plain(double x) { return formatted("%.10g", x); }

class Chart {
 public:
  Chart(const Subject &subject, const Study &study, Canvas &canvas) : s_(subject), t_(study), c_(canvas) {
    std::vector<double> costs, errors = {t_.options.target, t_.reference_headline};
    most_ = std::max({kWrong, t_.options.target, t_.reference_headline, t_.rows[0].headline});
    for (const size_t i : t_.front) most_ = std::max(most_, t_.rows[i].headline);
    for (size_t i = 0; i < t_.rows.size(); ++i)
      if (shown(i)) {
        costs.push_back(t_.rows[i].cpu_per_s);
        errors.push_back(std::min(t_.rows[i].headline, most_));
        beyond_ += t_.rows[i].headline > most_;
      }
    x_ = scale_of(costs, kLeft, kChartWidth - kRight);
    y_ = scale_of(errors, kChartHeight - kBottom, kTop);
  }

  void draw() {
    c_.box(0, 0, kChartWidth, kChartHeight, kPaper);
    band();
    grid();
    target();
    points();
    front();
    legend();
    c_.text(kLeft - 8, 24, 13, "What accuracy costs: " + s_.path.substr(s_.path.rfind('/') + 1), kText, 0);
  }

 private:
  bool shown(size_t i) const {
    const Row &row = t_.rows[i];
    return row.compared && int(i) != t_.reference && row.headline > 0 && row.cpu_per_s > 0;
  }

  Ink ink_of(size_t i) {
    const std::string model = describe(s_, t_.rows[i]).model;
    const auto found = inks_.try_emplace(model, inks_.size()).first;
    return kInks[found->second % std::size(kInks)];
  }

  // What the reference cannot distinguish.
  void band() {
    if (!(t_.reference_headline > 0)) return;
    const double top = y_.at(t_.reference_headline);
    c_.box(kLeft, top, x_.to - kLeft, y_.from - top, kBand);
    c_.text(x_.to - 6, y_.from - 8, 8, "below the reference's own error", kGray, 1);
  }

  void grid() {
    for (int d = int(std::ceil(x_.lo)); d <= int(std::floor(x_.hi)); ++d) {
      const double x = x_.at(std::pow(10, d));
      c_.line(x, kTop, x, y_.from, 1, kFaint, false);
      c_.text(x, y_.from + 20, 9, plain(std::pow(10, d)), kText, 0.5);
    }
    for (int d = int(std::ceil(y_.lo)) - 1; d <= int(std::floor(y_.hi)); ++d)
      for (const double part : {1.0, 2.0, 5.0}) {
        const double value = part * std::pow(10, d);
        if (std::log10(value) < y_.lo || std::log10(value) > y_.hi) continue;
        const double y = y_.at(value);
        c_.line(kLeft, y, x_.to, y, 1, kFaint, false);
        c_.text(kLeft - 8, y + 4, 9, plain(100 * value) + " %", kText, 1);
      }
    c_.line(kLeft, y_.from, x_.to, y_.from, 1.5, kText, false);
    c_.line(kLeft, kTop, kLeft, y_.from, 1.5, kText, false);
    c_.text((kLeft + x_.to) / 2, kChartHeight - 20, 10,
            s_.at_rest ? "processor seconds" : "processor seconds for a simulated second", kText, 0.5);
    std::string of = t_.headline[0];
    if (t_.headline.size() > 1) of = "the largest of " + std::to_string(t_.headline.size()) + " quantities";
    c_.text(kLeft - 8, kTop - 9, 9, "error of " + of, kText, 0);
    if (beyond_ > 0)
      c_.text(x_.to - 6, kTop - 9, 8,
              std::to_string(beyond_) + " above " + percent(most_) + ", at the upper edge", kGray, 1);
    if (!s_.at_rest && x_.lo < 0 && x_.hi > 0) {
      c_.line(x_.at(1), kTop, x_.at(1), y_.from, 1.5, kGray, true);
      c_.text(x_.at(1) + 5, kTop + 12, 8, "real time on one core", kGray, 0);
    }
  }

  void target() {
    const double y = y_.at(t_.options.target);
    c_.line(kLeft, y, x_.to, y, 1.5, kTarget, true);
    c_.text(x_.to - 6, y - 6, 9, "target " + percent(t_.options.target), kTarget, 1);
  }

  std::string tip(size_t i) const {
    const Row &row = t_.rows[i];
    return row.job.label + ": " + percent(row.headline) + ", " +
           plain(std::round(1e4 * row.cpu_per_s) / 1e4) + " " + t_.cost_unit;
  }

  void points() {
    for (size_t i = 0; i < t_.rows.size(); ++i)
      if (shown(i)) c_.disc(x_.at(t_.rows[i].cpu_per_s), y_.at(t_.rows[i].headline), 4, ink_of(i), tip(i));
  }

  void front() {
    for (size_t k = 0; k + 1 < t_.front.size(); ++k) {
      const Row &a = t_.rows[t_.front[k]], &b = t_.rows[t_.front[k + 1]];
      // Between two members the dearer one buys nothing yet: stairs.
      const double xa = x_.at(a.cpu_per_s), xb = x_.at(b.cpu_per_s), ya = y_.at(a.headline),
                   yb = y_.at(b.headline);
      c_.line(xa, ya, xb, ya, 1.5, kFront, false);
      c_.line(xb, ya, xb, yb, 1.5, kFront, false);
    }
    for (size_t k = 0; k < t_.front.size(); ++k) {
      const size_t i = t_.front[k];
      if (!shown(i)) continue;
      const double x = x_.at(t_.rows[i].cpu_per_s), y = y_.at(t_.rows[i].headline);
      const bool picked = int(i) == t_.pick;
      c_.disc(x, y, picked ? 11 : 8, picked ? kTarget : kFront, "");
      c_.disc(x, y, picked ? 8.5 : 6.5, kPaper, "");
      c_.disc(x, y, picked ? 7 : 5.5, ink_of(i), tip(i));
      c_.text(x + 11, y - 8, 9, std::to_string(k + 1), kText, 0);
    }
    if (t_.mesh_stays && shown(size_t(t_.pick))) {
      const Row &row = t_.rows[size_t(t_.pick)];
      const double x = x_.at(row.cpu_per_s), y = y_.at(row.headline);
      c_.disc(x, y, 11, kTarget, "");
      c_.disc(x, y, 8.5, kPaper, "");
      c_.disc(x, y, 7, ink_of(size_t(t_.pick)), tip(size_t(t_.pick)));
      c_.text(x + 13, y + 4, 8, "chosen on this mesh", kTarget, 0);
    }
    if (!shown(0)) return;
    const double x = x_.at(t_.rows[0].cpu_per_s), y = y_.at(t_.rows[0].headline);
    for (const double side : {-1.0, 1.0}) {
      c_.line(x - 9, y + 9 * side, x + 9, y + 9 * side, 1.5, kText, false);
      c_.line(x + 9 * side, y - 9, x + 9 * side, y + 9, 1.5, kText, false);
    }
    c_.text(x + 13, y + 14, 8, "the scene as it is", kText, 0);
  }

  static std::string fitted(const std::string &words) {
    return words.size() <= 46 ? words : words.substr(0, 44) + "..";
  }

  void legend() {
    const double x = x_.to + 26;
    double y = kTop + 2;
    c_.text(x, y, 9, "the front", kText, 0);
    for (size_t k = 0; k < t_.front.size() && k < 14; ++k) {
      const size_t i = t_.front[k];
      y += 24;
      c_.disc(x + 5, y - 4, 5, ink_of(i), "");
      const bool picked = int(i) == t_.pick;
      c_.text(x + 16, y, 8,
              std::to_string(k + 1) + "  " + percent(t_.rows[i].headline) + "  " + (picked ? "CHOSEN" : ""),
              picked ? kTarget : kText, 0);
      y += 13;
      c_.text(x + 16, y, 7, fitted(t_.rows[i].job.label), kGray, 0);
    }
    y += 30;
    c_.text(x, y, 9, "models", kText, 0);
    size_t n = 0;
    for (const auto &[model, ink] : inks_) {
      if (n % 2 == 0) y += 18;
      const double at = x + (n % 2) * 150;
      c_.disc(at + 5, y - 4, 4, kInks[ink % std::size(kInks)], "");
      c_.text(at + 16, y, 7.5, fitted(model).substr(0, 20), kText, 0);
      ++n;
    }
  }

  const Subject &s_;
  const Study &t_;
  Canvas &c_;
  Scale x_{}, y_{};
  double most_ = kWrong;                // the largest error on the scale
  size_t beyond_ = 0;                   // choices above it
  std::map<std::string, size_t> inks_;  // by model, in order of appearance
};

}  // namespace

void draw_chart(const Subject &subject, const Study &study, Canvas &canvas) {
  Chart(subject, study, canvas).draw();
}

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
