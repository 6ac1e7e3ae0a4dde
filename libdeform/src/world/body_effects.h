// Reports on a body's model beyond forces: its effects, how to switch them off, and numbers that the model
// computed at creation.
#pragma once
#include <string>
#include <vector>

#include "state/body.h"

namespace dfm {

struct EffectSwitch {
  const dfm_param *row;
  double off, now;
};
struct BodyEffect {
  std::string name;
  bool works = false;                  // with the present parameters
  std::vector<EffectSwitch> switches;  // all of them together switch it off; empty: no parameter does
  // if the list of effects leaves it out: the parameters that called for it, for example "volume 1"
  std::vector<std::string> would;
};

// In the order of the type's table; the model's extensions "dfm.effects/1" and "dfm.effect_rows/1".
std::vector<BodyEffect> body_effects(const Body &b);

std::vector<LeftOut> left_out_of(const Body &b);  // by the list of effects

struct BodyFact {
  std::string key, label, unit;
  double value;
};
// By the model's extension "dfm.facts/1".
std::vector<BodyFact> body_facts(const Body &b);

// A parameter's value as scenes give it, JSON.
std::string param_text(const dfm_param &row, double value);

}  // namespace dfm
