#include "step_size.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "json_text.h"
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

void check_first_step(const SceneFile &scene) {
  if (scene.value("/time/mode") == "\"static\"") return;
  JsonValue plan;
  if (!parse_json(scene.explain(), plan))
    throw Failure(kBadInput, scene.path() + ": its plan cannot be read");
  const JsonValue *const bound = plan.find("step"), *const bodies = plan.find("bodies");
  if (!bound || !bodies) return;
  const std::string name = bound->get("worst_body");
  for (const JsonValue &body : bodies->items)
    if (const JsonValue *const by = body.find("integrator"); body.get("name") == name && by)
      if (by->get("why").rfind("auto", 0) == 0) return;
  const double stable = bound->scalar("stable_s");  // 0: nothing bounds it
  const double start = dfm_world_time(scene.world()), step = next_step(scene, start, start);
  const uint32_t most = dfm_world_def_default().max_substeps;  // scenes have no key for it
  if (!(stable > 0) || !(std::ceil(step / stable - 1e-9) > most)) return;
  throw Failure(
      kBadInput,
      scene.path() +
          formatted(": /time/step: a step of %g s needs %.0f sub-steps of %g s, and at most %u are taken",
                    step, std::ceil(step / stable - 1e-9), stable, most) +
          ": let body '" + name + "', whose point " + bound->get("worst_point") +
          " bounds the step, move by tr_bdf2 or implicit_euler, soften or coarsen it, lower its "
          "damping, or take a shorter step");
}

}  // namespace cli
