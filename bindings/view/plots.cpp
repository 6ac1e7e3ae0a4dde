#include "plots.h"

#include <cmath>

#include "messages.h"
#include "run.h"

namespace view {
namespace {

constexpr size_t kMax = 600;  // samples

}  // namespace

void Plot::add(double time, const double *values) {
  if (!times.empty() && time <= times.back()) return;
  const auto push = [](auto &list, auto x) {
    if (list.size() == kMax) list.erase(list.begin());
    list.push_back(x);
  };
  push(times, time);
  for (size_t i = 0; i < curves.size(); ++i) push(curves[i].values, float(values[i]));
}

void Plot::clear() {
  times.clear();
  for (Curve &c : curves) c.values.clear();
}

Plots::Plots(const live::Simulation &simulation, const live::Grip &grip)
    : simulation_(simulation), grip_(grip) {
  plots_.push_back({"energy", "J", {{"kinetic", {}}, {"elastic", {}}}, false, -1});
  const cli::SceneFile &scene = simulation.scene();
  for (uint32_t i = 0; i < scene.settings().nprobe; ++i) {
    const char *name = "";
    double at[3];
    cli::need(dfm_scene_probe(scene.scene(), i, &name, at, nullptr));
    starts_.insert(starts_.end(), at, at + 3);
    plots_.push_back({std::string("probe ") + name + ", from its start",
                      "m",
                      {{"x", {}}, {"y", {}}, {"z", {}}},
                      false,
                      -1});
  }
  for (size_t i = 0; i < grip.count(); ++i) {
    const std::vector<Curve> axes = {{"x", {}}, {"y", {}}, {"z", {}}};
    plots_.push_back({"force on " + grip.name(i), "N", axes, false, int(i)});
    plots_.push_back({"torque on it", "N m", axes, false, int(i)});
  }
  plots_.push_back({"time of a step", "ms", {{"", {}}}, true, -1});
}

void Plots::clear() {
  for (Plot &p : plots_) p.clear();
}

void Plots::sample() {
  const double t = simulation_.time();
  if (!plots_[0].times.empty() && t <= plots_[0].times.back()) return;
  const cli::SceneFile &scene = simulation_.scene();
  scene.renew_list();
  double kinetic = 0, elastic = 0;
  for (const cli::BodyView &body : scene.bodies()) {
    const dfm_body_measure m = cli::body_measure(body);
    kinetic += m.kinetic;
    if (std::isfinite(m.elastic)) elastic += m.elastic;
  }
  std::vector<double> row{kinetic, elastic};
  for (uint32_t i = 0; i < scene.settings().nprobe; ++i) {
    double at[3];
    cli::need(dfm_scene_probe(scene.scene(), i, nullptr, at, nullptr));
    for (size_t k = 0; k < 3; ++k) row.push_back(at[k] - starts_[3 * i + k]);
  }
  for (size_t i = 0; i < grip_.count(); ++i) {
    const live::Felt felt = grip_.felt(i);
    row.insert(row.end(), {felt.force.x, felt.force.y, felt.force.z});
    row.insert(row.end(), {felt.torque.x, felt.torque.y, felt.torque.z});
  }
  row.push_back(simulation_.step_ms());
  const double *next = row.data();
  for (Plot &p : plots_) {
    p.add(t, next);
    next += p.curves.size();
  }
}

}  // namespace view
