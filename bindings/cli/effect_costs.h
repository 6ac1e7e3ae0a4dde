// What each effect that a body's model brings costs in a scene, on this machine.
#pragma once
#include <string>
#include <vector>

#include "scene_file.h"

namespace cli {

class Command;
struct JsonValue;

// Processor time of a step with the effect less that of one without it, s: the median over pairs, and the
// range that holds it with a probability of 99 %. In each pair both worlds take the same steps from the
// start.
struct EffectCost {
  std::string body, effect;  // body: "" where it is the scene's
  std::string why_not;       // where nothing could be measured; the rest is 0 then
  double median = 0, low = 0, high = 0;
  double with = 0;  // the whole step with the effect, s
  unsigned steps = 0, pairs = 0;
  bool clear() const { return low > 0 || high < 0; }  // of the noise
};

// Measures every effect that is at work and that a parameter switches off; plan: what scene.explain() says.
using MeasureEffects = std::vector<EffectCost>(Globals &globals, SceneFile &scene,
                                               const std::vector<std::string> &set, const JsonValue &plan);
MeasureEffects measure_effects;  // of deform-cost
// `deform explain`. measure: for --costs; null: the command becomes deform-cost there.
void add_explain(Command app, Globals &globals, int *exit_code, MeasureEffects *measure);

// [{"body", "effect", "us_per_step", "low", "high", "share", "steps", "pairs"} or {.., "why_not"}]
std::string costs_json(const std::vector<EffectCost> &costs);

// The effects of each body: used or idle, and with which parameters; what they cost, where it was measured.
void print_effects(const JsonValue &plan, const std::vector<EffectCost> *costs);

}  // namespace cli
