#include "planned.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "json_text.h"
#include "messages.h"

namespace cli {
namespace {

std::string percent(const JsonValue &row, const char *key) {
  const double share = 100 * row.scalar(key);
  return formatted(share < 99.5 ? "%.2g %%" : "%.0f %%", share);
}

void print_way(const JsonValue &way, const char *begin) {
  const std::vector<JsonValue> &bodies = way.list("bodies");
  std::string models;
  for (size_t i = 0; i < bodies.size() && i < 4; ++i) models += (i ? ", " : "") + bodies[i].get("model");
  if (bodies.size() > 4) models += ", ...";
  const std::string scheme = bodies.empty() ? "" : bodies[0].get("integrator");
  const double h = way.scalar("step");
  const std::string step = h > 0 ? formatted("%.3g ms", 1e3 * h) : "auto";
  const char *const each = std::fabs(h - way.scalar("frame_s")) < 1e-6 * h ? "step" : "1/60 s";
  std::printf("%s%-38s  %-16s  step %-9s  error %-8s  %.3g s of processor per second, %.3g ms per %s\n",
              begin, models.c_str(), scheme.c_str(), step.c_str(), percent(way, "error").c_str(),
              way.scalar("cpu_s_per_s"), way.scalar("ms_per_step"), each);
}

// "meets" is null where the prediction leaves something out: the choice is the one that is predicted to meet.
bool nearest(const JsonValue &plan) { return plan.get("meets") == "false"; }

}  // namespace

std::string planned_json(const SceneFile &scene) {
  const std::string accuracy = scene.value("/accuracy/chosen");
  return accuracy.empty() ? scene.value("/budget/chosen") : accuracy;
}

void print_planned(const std::string &json) {
  JsonValue plan;
  if (json.empty() || !parse_json(json, plan)) return;
  std::printf("planner (predicted, not measured; deform cost measures)\n  by costs of: %s\n",
              plan.get("costs").c_str());
  const JsonValue *const set = plan.find("set"), *const way = plan.find("predicted");
  for (const JsonValue &assumed : plan.list("assumed")) std::printf("  assumed: %s\n", assumed.text.c_str());
  for (const JsonValue &other : plan.list("considered")) print_way(other, "  possible: ");
  if (way) {
    print_way(*way, nearest(plan) ? "  nearest:  " : "  chosen:   ");
    if (const std::string missed = plan.get("missed"); !missed.empty())
      std::printf("  %s %s; deform cost measures what each costs\n",
                  nearest(plan) ? "missed:  " : "unknown: ", missed.c_str());
    for (const JsonValue &b : way->list("bodies"))
      std::printf("  %-20s  %s: error of the model %s, of time %s, of the mesh %s\n", b.get("name").c_str(),
                  b.get("model").c_str(), percent(b, "model_error").c_str(), percent(b, "time_error").c_str(),
                  percent(b, "mesh_error").c_str());
  }
  for (size_t i = 0; set && i < set->members.size(); ++i)
    std::printf("  to fix it in the scene: --set %s=%s\n", set->members[i].name.c_str(),
                set->members[i].value.text.c_str());
}

void print_choice(const std::string &json) {
  JsonValue plan;
  if (json.empty() || !parse_json(json, plan)) return;
  if (const JsonValue *const way = plan.find("predicted"))
    print_way(*way, nearest(plan) ? "planner, nearest: " : "planner: ");
}

std::string planned_sentence(const std::string &json) {
  JsonValue plan;
  if (json.empty() || !parse_json(json, plan) || plan.get("meets") == "true") return "";
  return "planner: " + plan.get("missed") + (nearest(plan) ? "; the nearest choice is simulated" : "") +
         " (see: deform explain; deform cost measures)";
}

}  // namespace cli
