#include "simulation.h"

#include <chrono>

#include "messages.h"
#include "step_size.h"

namespace view {

Simulation::Simulation(const cli::SceneFile &scene, double start)
    : scene_(scene), world_(scene.world()), start_(start) {
  size_t bytes = 0;
  cli::need(dfm_world_snapshot(world_, nullptr, &bytes));
  first_.resize(bytes);
  cli::need(dfm_world_snapshot(world_, first_.data(), &bytes));
}

double Simulation::time() const { return dfm_world_time(world_) - start_; }

bool Simulation::at_end() const {
  return !beyond_ && cli::next_step(scene_, start_, dfm_world_time(world_)) <= 0;
}

bool Simulation::step() {
  const double now = dfm_world_time(world_);
  const double left = cli::next_step(scene_, start_, now);
  if (left <= 0 && !beyond_) return false;
  const double step = left > 0 ? left : cli::full_step(scene_);
  const auto begin = std::chrono::steady_clock::now();
  trouble_.clear();
  if (dfm_world_step(world_, step, nullptr) != DFM_OK) {
    trouble_ = dfm_last_error();
    return false;
  }
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  step_ms_ += (step_ms_ > 0 ? 0.05 : 1) * (ms - step_ms_);
  return true;
}

void Simulation::restart() {
  cli::need(dfm_world_restore(world_, first_.data(), first_.size()));
  was_set();
}

void Simulation::was_set() {
  beyond_ = false;
  trouble_.clear();
}

}  // namespace view
