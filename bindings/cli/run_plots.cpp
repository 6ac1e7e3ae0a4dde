#include "run_plots.h"

#include "messages.h"

#ifdef DEFORM_HAVE_RENDER
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <vector>

#include "canvas.h"
#include "run.h"

namespace cli {
namespace {

constexpr size_t kMax = 6;                  // curves of a plot, and probes that have one
constexpr double kWide = 540, kHigh = 270;  // pixels, of a panel
enum { kEnergy, kPlace, kSpeed, kForce, kProbe };

struct Curve {
  std::string name;
  std::vector<double> y;  // NAN: a gap
};

struct Plot {
  std::string title;
  std::vector<Curve> curves;
};

// A linear axis: its ends, and steps of 1, 2 or 5 times a power of ten.
struct Axis {
  double low, high, from, to, step;  // from, to: pixels
  Axis(double least, double most, double first, double last, int ticks)
      : low(least), high(most), from(first), to(last) {
    if (!(high > low)) {
      const double room = std::max(1e-12, 0.1 * std::fabs(low));
      low -= room;
      high += room;
    }
    const double rough = (high - low) / ticks, base = std::pow(10, std::floor(std::log10(rough)));
    step = base * (rough > 5 * base ? 10 : rough > 2 * base ? 5 : rough > base ? 2 : 1);
  }
  double at(double x) const { return from + (x - low) / (high - low) * (to - from); }
  template <class F>
  void each_tick(F &&tick) const {
    for (double n = std::ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; ++n)
      tick(at(n * step), formatted("%.4g", n * step + 0.0));
  }
};

void draw_panel(Canvas &canvas, const std::vector<double> &t, const Plot &plot, double x0, double y0) {
  constexpr Ink kText{0.13f, 0.15f, 0.18f}, kFaint{0.86f, 0.87f, 0.89f};
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const Curve &c : plot.curves)
    for (const double y : c.y)
      if (std::isfinite(y)) {
        low = std::min(low, y);
        high = std::max(high, y);
      }
  if (low > high) low = high = 0;
  const double left = x0 + 66, right = x0 + kWide - 20, top = y0 + 38, bottom = y0 + kHigh - 38;
  const Axis across(t.front(), t.back(), left, right, 6), up(low, high, bottom, top, 5);
  across.each_tick([&](double x, const std::string &text) {
    canvas.line(x, top, x, bottom, 1, kFaint, false);
    canvas.text(x, bottom + 16, 7.5, text, kText, 0.5);
  });
  up.each_tick([&](double y, const std::string &text) {
    canvas.line(left, y, right, y, 1, kFaint, false);
    canvas.text(left - 6, y + 4, 7.5, text, kText, 1);
  });
  canvas.line(left, bottom, right, bottom, 1.5, kText, false);
  canvas.text(right, bottom + 31, 7.5, "t [s]", kText, 1);
  canvas.text(left, top - 12, 9, plot.title, kText, 0);
  double pen = left + render::text_width(9, plot.title) + 18;
  for (size_t c = 0; c < plot.curves.size(); ++c) {
    const render::Color color = render::palette(uint32_t(c));
    const Ink ink{color.r, color.g, color.b};
    const std::vector<double> &y = plot.curves[c].y;
    for (size_t i = 0; i + 1 < t.size(); ++i)
      if (std::isfinite(y[i]) && std::isfinite(y[i + 1]))
        canvas.line(across.at(t[i]), up.at(y[i]), across.at(t[i + 1]), up.at(y[i + 1]), 1.5, ink, false);
    canvas.text(pen, top - 12, 8, plot.curves[c].name, ink, 0);
    pen += render::text_width(8, plot.curves[c].name) + 12;
  }
}

class Drawn : public RunPlots {
 public:
  explicit Drawn(const SceneFile &scene) : scene_(scene) {
    plots_ = {{"energy [J]", {}},
              {"displacement of the center of mass [m]", {}},
              {"speed of the fastest point [m/s]", {}},
              {"normal force [N]", {}}};
    const char *name = nullptr;
    for (uint32_t i = 0; i < probes(); ++i) {
      need(dfm_scene_probe(scene.scene(), i, &name, probe_starts_.emplace_back().data(), nullptr));
      plots_.push_back({std::string(name) + ", from its start [m]", {}});
    }
  }

  void record() override {
    times_.push_back(dfm_world_time(scene_.world()));
    double kinetic = 0, elastic = 0;
    const auto add = [&](const std::string &name, const dfm_body_measure &m) {
      kinetic += m.kinetic;
      if (std::isfinite(m.elastic)) elastic += m.elastic;
      const auto [start, first] = starts_.try_emplace(name, std::array{m.com[0], m.com[1], m.com[2]});
      double way[3];
      for (size_t k = 0; k < 3; ++k) way[k] = m.com[k] - start->second[k];
      set(kPlace, name, norm(way));
      set(kSpeed, name, m.speed_max);
    };
    for (const BodyView &body : scene_.bodies()) add(body.name, body_measure(body));
    for (const RigidView &rigid : scene_.rigids()) add(rigid.name, rigid_measure(rigid));
    set(kEnergy, "kinetic", kinetic);
    set(kEnergy, "elastic", elastic);
    for (Curve &c : plots_[kForce].curves) c.y.resize(times_.size(), 0);  // apart: none
    for (const dfm_pair_report &p : listed<dfm_pair_report>(dfm_world_pairs, scene_.world()))
      set(kForce, scene_.name_of(p.a) + ", " + scene_.name_of(p.b), p.normal, 0);
    for (uint32_t i = 0; i < probes(); ++i) {
      double at[3];
      need(dfm_scene_probe(scene_.scene(), i, nullptr, at, nullptr));
      for (size_t k = 0; k < 3; ++k) set(kProbe + i, std::string(1, "xyz"[k]), at[k] - probe_starts_[i][k]);
    }
  }

  void write(const std::string &path) const override {
    std::vector<Plot> shown;
    for (const Plot &plot : plots_) {
      if (plot.curves.empty()) continue;  // nothing touched
      shown.push_back(plot);
      for (Curve &c : shown.back().curves) c.y.resize(times_.size(), NAN);  // gone since
    }
    PixelCanvas canvas(2 * kWide, double((shown.size() + 1) / 2) * kHigh);
    for (size_t i = 0; i < shown.size(); ++i)
      draw_panel(canvas, times_, shown[i], double(i % 2) * kWide, double(i / 2) * kHigh);
    canvas.write(path);
  }

 private:
  uint32_t probes() const { return std::min<uint32_t>(scene_.settings().nprobe, kMax); }

  // The present value of a curve, which had `before` where it was not set.
  void set(size_t plot, const std::string &name, double value, double before = NAN) {
    std::vector<Curve> &curves = plots_[plot].curves;
    auto found = std::ranges::find(curves, name, &Curve::name);
    if (found == curves.end()) {
      if (curves.size() == kMax) return;
      found = curves.insert(found, {name, {}});
    }
    found->y.resize(times_.size(), before);
    found->y.back() = value;
  }

  const SceneFile &scene_;
  std::vector<double> times_;                            // s
  std::map<std::string, std::array<double, 3>> starts_;  // m, centers of mass
  std::vector<std::array<double, 3>> probe_starts_;      // m
  std::vector<Plot> plots_;
};

}  // namespace

std::unique_ptr<RunPlots> RunPlots::create(const SceneFile &scene) { return std::make_unique<Drawn>(scene); }

}  // namespace cli

#else

namespace cli {

std::unique_ptr<RunPlots> RunPlots::create(const SceneFile &) {
  warn("no plots: this deform was built without the renderer (cmake -DDEFORM_RENDER=ON)");
  return nullptr;
}

}  // namespace cli

#endif
