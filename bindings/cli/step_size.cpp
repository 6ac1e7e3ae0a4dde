#include "step_size.h"

#include <algorithm>
#include <cmath>

#include "messages.h"

namespace cli {

double full_step(const SceneFile &scene) {
  double step = scene.settings().step;
  if (step > 0) return step;
  need(dfm_world_stable_step(scene.world(), &step, nullptr, nullptr));
  if (!std::isfinite(step)) step = 1e-3;  // nothing bounds it: no springs, no contact
  // Implicit steps may be longer than the time between two records that the scene asks for.
  return scene.settings().every > 0 ? std::min(step, scene.settings().every) : step;
}

double longest_step(const SceneFile &scene) {
  constexpr double most = 1.0 / 30;  // s, of dfm_world_stable_step
  const double step = scene.settings().step, every = scene.settings().every;
  return step > 0 ? step : every > 0 ? std::min(most, every) : most;
}

double next_step(const SceneFile &scene, double start, double now) {
  const double duration = scene.settings().duration, left = start + duration - now;
  const bool automatic = scene.settings().step <= 0;
  double step = full_step(scene);
  // Rather two halves at the end than one step and a sliver.
  if (automatic && left < 2 * step && left > step) step = left / 2;
  if (left <= 1e-6 * std::min(step, duration)) return 0;
  // Rather a last step that is a thousandth longer than one more that is too short to be taken.
  if (left < step * (1 + (automatic ? 1e-6 : 1e-3)) && (automatic || std::fabs(left - step) > 1e-6 * step))
    step = left;
  return step;
}

}  // namespace cli
