#include "effect_costs.h"

#include <cstdio>

#include "json_text.h"

namespace cli {
namespace {

std::string switches_text(const JsonValue &effect, const char *which) {
  std::string out;
  for (const JsonValue &s : effect.list("switches"))
    out += (out.empty() ? "" : ", ") + s.get("key") + " " + s.get(which);
  return out;
}

void print_cost(const EffectCost &c) {
  if (!c.why_not.empty()) {
    std::printf("; not measured: %s", c.why_not.c_str());
    return;
  }
  const bool saves = c.clear() && c.median < 0;
  const char *const unit = saves ? "saves" : c.clear() ? "costs" : "costs less than the noise:";
  std::printf("; %s %.3g us per step, %+.2g %% (%+.3g to %+.3g us; %u pairs of %u steps)", unit,
              saves ? -1e6 * c.median : 1e6 * c.median, c.with > 0 ? 100 * c.median / c.with : 0.0,
              1e6 * c.low, 1e6 * c.high, c.pairs, c.steps);
}

// The effects of each law: used, idle, or its own.
void print_laws(const JsonValue &plan) {
  if (!plan.list("laws").empty()) std::printf("effects of each law\n");
  for (const JsonValue &law : plan.list("laws")) {
    const std::string name = law.get("name"), requested = law.get("asked");
    if (requested != name) std::printf("  %-20s  in place of %s\n", name.c_str(), requested.c_str());
    for (const JsonValue &effect : law.list("effects")) {
      const bool works = effect.get("works") == "true";
      const char *const word = effect.get("used") == "true" ? "used" : works ? "on, not asked for" : "idle";
      std::printf("  %-20s  %-18s  %s%s\n", name.c_str(), effect.get("name").c_str(), word,
                  works && effect.get("switchable") != "true"
                      ? "; no parameter switches it off: it is the law's own"
                      : "");
    }
  }
}

const EffectCost *cost_of(const std::vector<EffectCost> *costs, const std::string &body,
                          const std::string &effect) {
  for (size_t i = 0; costs && i < costs->size(); ++i)
    if ((*costs)[i].body == body && (*costs)[i].effect == effect) return &(*costs)[i];
  return nullptr;
}

}  // namespace

std::string costs_json(const std::vector<EffectCost> &costs) {
  std::vector<std::string> rows;
  for (const EffectCost &c : costs) {
    JsonObject row;
    row.add("body", c.body.empty() ? "null" : quoted(c.body), "effect", quoted(c.effect));
    if (!c.why_not.empty()) {
      rows.push_back(row.add("why_not", quoted(c.why_not)).text());
      continue;
    }
    row.add("us_per_step", 1e6 * c.median, "low", 1e6 * c.low, "high", 1e6 * c.high, "share",
            c.with > 0 ? c.median / c.with : 0, "steps", c.steps, "pairs", c.pairs);
    rows.push_back(row.add("above_noise", c.clear()).text());
  }
  return json_array(rows);
}

void print_effects(const JsonValue &plan, const std::vector<EffectCost> *costs) {
  print_laws(plan);
  bool measurable = false;
  std::printf("effects of each body%s\n",
              costs ? ", and the processor time that each adds to a step, by pairs with and without it" : "");
  for (const JsonValue &b : plan.list("bodies")) {
    const std::string body = b.get("name");
    for (const JsonValue &effect : b.list("effects")) {
      const std::string name = effect.get("name"), off = switches_text(effect, "off");
      const bool works = effect.get("works") == "true";
      const char *const word = effect.get("used") == "true" ? "used" : works ? "on, not asked for" : "idle";
      std::printf("  %-20s  %-18s  %s", body.c_str(), name.c_str(), word);
      if (!works && off.empty()) std::printf(": not needed, as the body is held");
      else if (!works) std::printf(": %s", switches_text(effect, "now").c_str());
      else if (off.empty()) std::printf("; no parameter switches it off: it is the model's own");
      else std::printf("; off with %s", off.c_str());
      measurable |= works && !off.empty();
      if (const EffectCost *const cost = cost_of(costs, body, name)) print_cost(*cost);
      std::printf("\n");
    }
  }
  for (size_t i = 0; costs && i < costs->size(); ++i) {
    const EffectCost &c = (*costs)[i];
    if (!c.body.empty()) continue;
    std::printf("  %-20s  %-18s  used; off where the list of effects does not have it", "(scene)",
                c.effect.c_str());
    print_cost(c);
    std::printf("\n");
  }
  if (!costs && measurable) std::printf("  --costs measures on this machine what each of them costs\n");
}

}  // namespace cli
